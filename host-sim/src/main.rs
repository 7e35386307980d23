//! Prototype.
use impromptu_firmware::{adapter::Lanes, model::Model};
use impromptu_host_sim::{condition::Condition, experiment::*, plant::Vehicle, trajectory::strokes};
use impromptu_model_export::{Precision, encode};
use std::time::Instant;

fn main() -> anyhow::Result<()> {
    let args: Vec<String> = std::env::args().collect();
    let get = |i: usize, d: &str| args.get(i).cloned().unwrap_or(d.into());
    let recipe: Recipe = match std::env::var("RECIPE") {
        Ok(text) => toml::from_str(&text)?,
        Err(_) => Recipe::default(),
    };
    let (vehicle, gains) = (get(1, "crazyflie"), get(2, "stock"));
    let conditions = get(3, "clean,lab,rough");
    for name in conditions.split(',') {
        let condition = Condition::named(name).unwrap();
        let plant = Loop::new(Vehicle::named(&vehicle)?, &gains, condition.clone())?;
        let t = Instant::now();
        let mut logs = Vec::new();
        for (k, e) in recipe.excitations.iter().enumerate() {
            logs.extend(plant.collect(&e.motions(1000 + 100 * k as u64), None, 5000 + 100 * k as u64)?);
        }
        let t_collect = t.elapsed().as_secs_f64();
        let t = Instant::now();
        let smoothing = if name == "clean" { 0.0 } else { recipe.smoothing_s };
        let learned = learn(&recipe, &logs, condition.measurement_delay_s, smoothing, &mut |p| {
            if p.epoch == 0 || p.epoch == p.of {
                println!("==   epoch {} train {:.2e} val {:.2e}", p.epoch, p.training_loss, p.validation_loss)
            }
        })?;
        let t_learn = t.elapsed().as_secs_f64();
        let t = Instant::now();
        let dithered = dithered_logs(&recipe.lane, &plant, 77)?;
        let mut validation = Vec::new();
        for &speed in &recipe.validation_speeds {
            validation.extend(strokes(4242, recipe.validation_strokes, speed, 100.0)?);
        }
        let choice = choose_lane(&recipe, &plant, &dithered, &validation, 31, &|lane| {
            encode(
                &describe(&recipe, &plant, &learned, Some(lane), "x", "", 1),
                Some(&learned.quantised),
                Precision::Int8,
                &learned.calibration,
            )
        });
        match &choice {
            Ok(c) => println!("lane: {} mean {:.1} worst {:.1} margins {:?}", c.design, c.mean, c.worst, c.lane.margins),
            Err(e) => println!("lane refused: {e}"),
        }
        let t_lane = t.elapsed().as_secs_f64();
        let lane = choice.as_ref().ok().map(|c| &c.lane);
        let set = ModelSet::new(&recipe, &plant, &learned, lane, "", 1)?;
        println!(
            "== {vehicle} {gains} {name}: rows {} collect {t_collect:.1} learn {t_learn:.1} lane {t_lane:.1} s; int8 {} B",
            learned.rows,
            set.int8.len()
        );
        if std::env::var("QUICK").is_ok() {
            let _ = 0;
        }
        for (speed, delay) in [(1.0, 0.0), (1.0, 0.02), (1.35, 0.0), (1.7, 0.0)] {
            let plant = Loop { condition: condition.delayed(delay), ..plant.clone() };
            let test = strokes(9, 30, speed, 100.0)?;
            let base = plant.errors(&test, None, 1.0, 900)?;
            let mean = 100.0 * base.iter().sum::<f64>() / 30.0;
            print!("x{speed} +{:.0}ms base {mean:.1} cm;", delay * 1e3);
            for (label, bytes) in [("ff", &set.feedforward), ("ridge", &set.ridge), ("f32", &set.float), ("int8", &set.int8)] {
                let model = Model::from_bytes(bytes).map_err(|e| anyhow::anyhow!("{e}"))?;
                for (l, lanes) in [("", Lanes { network: true, feedback: false }), ("+fb", Lanes::BOTH)] {
                    let errors = plant.errors(&test, Some((&model, lanes)), 1.0, 900)?;
                    let (m, w) = reduction(&base, &errors);
                    print!(" {label}{l} {m:.1}/{w:.1}");
                }
                if label == "ff" {
                    let errors = plant.errors(&test, Some((&model, Lanes { network: false, feedback: true })), 1.0, 900)?;
                    let (m, w) = reduction(&base, &errors);
                    print!(" fb {m:.1}/{w:.1}");
                }
            }
            println!();
        }
    }
    Ok(())
}
