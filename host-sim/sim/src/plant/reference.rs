//! The plant against RotorPy's own numbers (`tests/reference/README.md`).

use std::collections::BTreeMap;
use std::fs::File;

use serde_json::Value;

use super::*;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/reference/");

/// A row by column name; `set` apart.
struct Row {
    set: String,
    values: BTreeMap<String, f64>,
}

impl Row {
    fn get<const N: usize>(&self, columns: [&str; N]) -> [f64; N] {
        columns.map(|column| self.values[column])
    }
}

fn rows(file: &str) -> Vec<Row> {
    let mut reader = csv::Reader::from_reader(File::open(format!("{FOLDER}{file}")).unwrap());
    let names = reader.headers().unwrap().clone();
    reader
        .records()
        .map(|record| {
            let record = record.unwrap();
            let values = names.iter().zip(&record).skip(1);
            Row {
                set: record[0].to_owned(),
                values: values.map(|(name, text)| (name.to_owned(), text.parse().unwrap())).collect(),
            }
        })
        .collect()
}

/// The vehicle of each set, made of the reference's own parameters.
fn vehicles() -> BTreeMap<String, Vehicle> {
    let file = File::open(format!("{FOLDER}params.json")).unwrap();
    let json: Value = serde_json::from_reader(file).unwrap();
    let sets = json["sets"].as_object().unwrap();
    sets.iter()
        .map(|(name, set)| {
            let constants = &set["params"];
            let number = |key: &str| constants[key].as_f64().unwrap();
            let aero = if set["aero"].as_bool().unwrap() { 1.0 } else { 0.0 };
            let rotor = |index: usize| Rotor {
                position: std::array::from_fn(|axis| constants["rotor_pos"][format!("r{}", index + 1)][axis].as_f64().unwrap()),
                direction: constants["rotor_directions"][index].as_i64().unwrap() as i8,
            };
            let vehicle = Vehicle {
                mass: number("mass"),
                thrust_coefficient: number("k_eta"),
                torque_coefficient: number("k_m"),
                rotor_drag: aero * number("k_d"),
                inflow_drag: aero * number("k_z"),
                translational_lift: aero * number("k_h"),
                flapping: aero * number("k_flap"),
                parasitic_drag: ["c_Dx", "c_Dy", "c_Dz"].map(|key| aero * number(key)),
                motor_time_constant: number("tau_m"),
                rotor_speed_min: number("rotor_speed_min"),
                rotor_speed_max: number("rotor_speed_max"),
                inertia: Inertia {
                    xx: number("Ixx"),
                    yy: number("Iyy"),
                    zz: number("Izz"),
                    xy: number("Ixy"),
                    yz: number("Iyz"),
                    xz: number("Ixz"),
                },
                attitude_gains: AttitudeGains { proportional: number("kp_att"), derivative: number("kd_att") },
                rotors: std::array::from_fn(rotor),
                ..Vehicle::named("hummingbird").unwrap()
            };
            vehicle.check().unwrap();
            (name.clone(), vehicle)
        })
        .collect()
}

fn plants() -> BTreeMap<String, Plant> {
    let plant = |vehicle| Plant::new(&vehicle, [Variation::default(); BATCH]);
    vehicles().into_iter().map(|(name, vehicle)| (name, plant(vehicle))).collect()
}

fn state(row: &Row, prefix: &str) -> State {
    let get = |name: &str| row.values[&format!("{prefix}{name}")];
    State {
        position: ["x", "y", "z"].map(get),
        velocity: ["vx", "vy", "vz"].map(get),
        attitude: ["qw", "qx", "qy", "qz"].map(get),
        body_rates: ["wx", "wy", "wz"].map(get),
        rotor_speeds: ["r1", "r2", "r3", "r4"].map(get),
    }
}

/// State, commands and disturbance of a row in every member.
fn inputs(row: &Row) -> (States, [Batch; 4], Disturbance) {
    let mut disturbance = Disturbance::default();
    for member in 0..BATCH {
        disturbance.set_member(member, row.get(["windx", "windy", "windz"]), [0.0; 3]);
    }
    let commands = row.get(["c1", "c2", "c3", "c4"]).map(|command| [command; BATCH]);
    (States::splat(&state(row, "")), commands, disturbance)
}

/// |a - b| / |b|, Euclidean norms.
fn deviation<const N: usize>(a: [f64; N], b: [f64; N]) -> f64 {
    let norm = |values: [f64; N]| values.iter().map(|value| value * value).sum::<f64>().sqrt();
    norm(std::array::from_fn(|i| a[i] - b[i])) / norm(b)
}

/// The largest deviation of each group of components, with the set where it occurs.
#[derive(Default)]
struct Worst(BTreeMap<&'static str, (f64, String)>);

impl Worst {
    fn add(&mut self, group: &'static str, deviation: f64, row: &Row) {
        let entry = self.0.entry(group).or_default();
        // Not a number counts as the worst.
        if deviation > entry.0 || deviation.is_nan() {
            *entry = (deviation, format!("{} {}", row.set, row.values["id"]));
        }
    }

    fn assert_below(&self, limits: &[(&str, f64)]) {
        assert_eq!(self.0.len(), limits.len());
        for (group, limit) in limits {
            let (value, place) = &self.0[group];
            assert!(value <= limit, "{group}: {value:e} in {place}, limit {limit:e}");
        }
    }
}

#[test]
fn derivatives_and_wrenches_are_the_reference_simulators() {
    let plants = plants();
    let mut worst = Worst::default();
    let mut count = 0;
    for row in rows("statedot.csv") {
        let (states, commands, disturbance) = inputs(&row);
        let plant = &plants[&row.set];
        let rate = plant.derivative(&states, &commands, &disturbance).member(3);
        let wrench = plant.wrench(&states, &disturbance)[3];
        let mut add = |group, deviation| worst.add(group, deviation, &row);
        add("position", deviation(rate.position, row.get(["dx", "dy", "dz"])));
        add("velocity", deviation(rate.velocity, row.get(["dvx", "dvy", "dvz"])));
        add("attitude", deviation(rate.attitude, row.get(["dqw", "dqx", "dqy", "dqz"])));
        add("body rates", deviation(rate.body_rates, row.get(["dwx", "dwy", "dwz"])));
        add("rotors", deviation(rate.rotor_speeds, row.get(["dr1", "dr2", "dr3", "dr4"])));
        add("force", deviation(wrench.force, row.get(["FBx", "FBy", "FBz"])));
        add("moment", deviation(wrench.moment, row.get(["MBx", "MBy", "MBz"])));
        count += 1;
    }
    assert_eq!(count, 1336);
    let groups = ["position", "velocity", "attitude", "body rates", "rotors", "force", "moment"];
    worst.assert_below(&groups.map(|group| (group, 1e-13)));
}

/// The relative error of the state after 1 to 100 ms, by the largest Runge-Kutta step. It falls with the step's fourth
/// power; Hummingbird's motors (5 ms) and the synthetic set are the stiff ones.
#[test]
fn steps_follow_the_reference_solution() {
    let plants = plants();
    let rows = rows("step.csv");
    assert_eq!(rows.len(), 720);
    for (longest, crazyflies, others) in [(0.002, 1.5e-7, 3e-4), (0.001, 1e-8, 2e-5), (0.00025, 4e-11, 6e-8)] {
        let mut worst = [Worst::default(), Worst::default()];
        for row in &rows {
            let (mut states, commands, disturbance) = inputs(row);
            let length = row.values["h"];
            let steps = (length / longest).round().max(1.0);
            for _ in 0..steps as usize {
                plants[&row.set].step(&mut states, &commands, &disturbance, length / steps);
            }
            let (found, truth) = (states.member(0), state(row, "e_"));
            let stiff = row.set.starts_with("hummingbird") || row.set.starts_with("synthetic");
            let mut add = |group, deviation| worst[usize::from(stiff)].add(group, deviation, row);
            add("position", deviation(found.position, truth.position));
            add("velocity", deviation(found.velocity, truth.velocity));
            add("attitude", deviation(found.attitude, truth.attitude));
            add("body rates", deviation(found.body_rates, truth.body_rates));
            add("rotors", deviation(found.rotor_speeds, truth.rotor_speeds));
        }
        let groups = ["position", "velocity", "attitude", "body rates", "rotors"];
        for (worst, limit) in worst.iter().zip([crazyflies, others]) {
            worst.assert_below(&groups.map(|group| (group, limit)));
        }
    }
}

#[test]
fn the_vehicle_files_hold_the_reference_parameters() {
    let reference = vehicles();
    for (name, set) in
        [("crazyflie", "crazyflie_aero"), ("crazyflie-brushless", "brushless_aero"), ("hummingbird", "hummingbird_aero")]
    {
        let ours = Vehicle::named(name).unwrap();
        let theirs = Vehicle { name: name.to_owned(), position_gains: ours.position_gains.clone(), ..reference[set].clone() };
        assert_eq!(ours, theirs);
    }
}
