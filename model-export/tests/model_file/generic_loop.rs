//! The add-on knows no quadrotor: the first system of Zhou 2017 (equation 9), flown with the exact inverse as a linear map.

use impromptu_firmware::{
    AddOn, Caps,
    adapter::Lanes,
    features::{Feature, Relative, Source},
    model::{Interpolation, Model, Output},
    network::Scratch,
    preview::EndRule,
};
use impromptu_model_export::{
    Description, FloatNetwork, Precision,
    description::{ChannelDescription, Provenance, Signals, Timing},
    encode,
};

use crate::fixture::{CAPS, table};

/// One output, two measured states, one reference; nothing has a unit.
fn description() -> Description {
    let channel =
        |name: &str| ChannelDescription { name: name.into(), unit: "1".into(), frame: "none".into(), end: EndRule::Hold };
    let state = |channel| Feature { source: Source::Measured, channel, offset: 0, relative: Relative::Nothing };
    Description {
        name: "S1".into(),
        provenance: Provenance { vehicle: "Zhou 2017, (9)".into(), ..Provenance::default() },
        signals: Signals {
            desired: vec![channel("y")],
            measured: vec![channel("x1"), channel("x2")],
            reference: vec![channel("y")],
        },
        timing: Timing {
            reference_rate_hz: 100.0,
            divisor: 1,
            interpolation: Interpolation::Hold,
            measurement_delay_s: 0.0,
            fade_s: 0.0,
        },
        features: vec![
            state(0),
            state(1),
            Feature { source: Source::Desired, channel: 0, offset: 1, relative: Relative::Desired(0) },
        ],
        outputs: vec![Output { channel: 0, limit: 100.0, slew: 100.0 }],
        envelope: vec![(-10.0, 10.0); 3],
        feedback_lane: None,
        monitor: None,
        tie: None,
    }
}

/// u = y_d(t+1) + 0.15 x1 - 0.6 x2, as a correction of y_d(t).
fn exact_law() -> FloatNetwork {
    FloatNetwork {
        input_mean: vec![0.0; 3],
        input_scale: vec![1.0; 3],
        layers: vec![],
        skip: Some(vec![0.15, -0.6, 1.0]),
        output_mean: vec![0.0],
        output_scale: vec![1.0],
        notes: Default::default(),
    }
}

/// RMS tracking error over 60 s of the paper's test signal at 10 ms.
fn tracking_error(lanes: Lanes) -> f64 {
    let description = description();
    let bytes = encode(&description, Some(&exact_law()), Precision::Float, &[]).unwrap();
    let model = Model::from_bytes(&bytes).unwrap();
    let mut add_on =
        AddOn::<1, 2, 1, 8>::new(&model, &table(&description), 100.0, &Caps { channels: &[CAPS.channels[0]], ..CAPS }).unwrap();
    add_on.switch(lanes);
    let desired = |tick: i32| {
        let t = 0.01 * f64::from(tick);
        (std::f64::consts::TAU * t / 15.0).sin() + (std::f64::consts::TAU * t / 12.0).cos() - 1.0
    };
    add_on.push([desired(0) as f32]).unwrap();
    let (mut x, mut sum) = ([0.0f64; 2], 0.0);
    let ticks = 6000;
    for tick in 0..ticks {
        add_on.push([desired(tick + 1) as f32]).unwrap();
        let [u] = add_on.step(tick, &x.map(|x| x as f32), &mut Scratch::new());
        x = [x[1], -0.15 * x[0] + 0.8 * x[1] + f64::from(u)];
        let y = -0.2 * x[0] + x[1];
        sum += (y - desired(tick + 1)).powi(2);
    }
    (sum / f64::from(ticks)).sqrt()
}

#[test]
fn the_exact_law_tracks_to_the_rounding_of_f32() {
    let with = tracking_error(Lanes { network: true, feedback: false });
    // The DC gain is 2.2857: without the add-on the loop is far off.
    let without = tracking_error(Lanes::NONE);
    assert!(with < 2e-7, "{with}");
    assert!(without > 1.0, "{without}");
}
