//! Flights turned about the vertical by quarter turns: three more of each.
//!
//! *in* a log; *out* logs of the same flight beside it; *never* for a vehicle that was seen to answer otherwise along y than
//! along x (`learn` compares); *source* a quadrotor with four equal arms is the same after a quarter turn.

use impromptu_sim::flight_log::{FlightLog, LogRow};

/// The flight turned by 90°, 180° and 270°: everything horizontal is, altitude and heading stay.
pub fn quarter_turns(log: &FlightLog) -> [FlightLog; 3] {
    let first = turn(log);
    let second = turn(&first);
    let third = turn(&second);
    [first, second, third]
}

fn turn(log: &FlightLog) -> FlightLog {
    let horizontal = |[x, y, z]: [f64; 3]| [-y, x, z];
    let rows = log.rows.iter().map(|row| {
        let mut turned = LogRow {
            reference_position: horizontal(row.reference_position),
            reference_velocity: horizontal(row.reference_velocity),
            measured_position: horizontal(row.measured_position),
            measured_velocity: horizontal(row.measured_velocity),
            // Who leans forward flies along x, who leans to the right against y: tilts turn like body rates.
            measured_body: row.measured_body.map(|[roll, pitch, yaw, wx, wy, wz, az]| [-pitch, roll, yaw, -wy, wx, wz, az]),
            true_position: row.true_position.map(horizontal),
            ..*row
        };
        let desired = &mut turned.desired;
        desired.position = horizontal(desired.position);
        desired.velocity = horizontal(desired.velocity);
        desired.acceleration = horizontal(desired.acceleration);
        turned
    });
    FlightLog { rows: rows.collect(), ..log.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_quarter_turns_are_none_and_the_vertical_stays() {
        let row = LogRow {
            measured_position: [1.0, 2.0, 3.0],
            // Leans forward, so it flies along x; turned it flies along y, for which it leans to the left.
            measured_body: Some([0.0, 0.1, 0.3, 4.0, 5.0, 6.0, 7.0]),
            ..LogRow::default()
        };
        let log = FlightLog { name: "a".into(), rate_hz: 100.0, scored: 0..1, rows: vec![row] };
        let [first, second, third] = quarter_turns(&log);
        assert_eq!(first.rows[0].measured_position, [-2.0, 1.0, 3.0]);
        assert_eq!(first.rows[0].measured_body, Some([-0.1, 0.0, 0.3, -5.0, 4.0, 6.0, 7.0]));
        assert_eq!(second.rows[0].measured_position, [-1.0, -2.0, 3.0]);
        assert_eq!(turn(&third), log);
    }
}
