//! The C face: its header is up to date, strict compilers accept it, C programs get the bits of Rust, and no call does harm.

mod crazyflie;
mod learner;
mod symbols;

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
    time::Duration,
};

use impromptu_firmware::{
    Caps,
    adapter::{Adapter, Lanes},
    model::Model,
    network::Scratch,
    preview::Preview,
};
use impromptu_flight::{
    caps,
    flight::{Flight, PREVIEW},
    quadrotor::{self, DESIRED, MEASURED, REFERENCE},
    replay::{Event, HEADER, Header, RECORD},
    types::{State, Tick},
};
use impromptu_model_export::Precision;
use impromptu_tests::{
    c::{self, Machine},
    golden,
};

use crate::board::{flight, model};

/// 12 s: lanes come and go, the trajectory turns.
const TICKS: u32 = 6_000;
const TIMEOUT: Duration = Duration::from_secs(120);
/// Calls from C in random order.
const CALLS: u32 = 200_000;

/// The bounds that the C programs give.
const CAPS: Caps<'_> = Caps { channels: &caps::CHANNELS, sums: &[] };

/// An empty folder for the test `name`.
fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    if folder.exists() {
        fs::remove_dir_all(&folder).unwrap();
    }
    fs::create_dir_all(&folder).unwrap();
    folder
}

#[test]
fn the_header_says_what_the_source_says() {
    let folder = c::crate_folder();
    let config = cbindgen::Config::from_file(folder.join("cbindgen.toml")).unwrap();
    let mut builder = cbindgen::Builder::new().with_config(config);
    for file in ["status", "memory", "values", "values/learner", "edge/model", "edge/adapter", "edge/flight", "edge/learner"] {
        builder = builder.with_src(folder.join("src").join(file).with_extension("rs"));
    }
    let mut header = Vec::new();
    builder.generate().unwrap().write(&mut header);
    let path = c::include().join("impromptu.h");
    if golden::updating() {
        fs::write(&path, &header).unwrap();
    }
    let committed = fs::read(&path).unwrap_or_default();
    assert!(committed == header, "{} is out of date; {}=1 writes it", path.display(), golden::UPDATE_VARIABLE);
}

#[test]
fn strict_compilers_of_c_and_cpp_accept_the_header() {
    let source = folder("c-header").join("header.c");
    fs::write(&source, "#include \"impromptu.h\"\nint nothing(void);\nint nothing(void) { return IMPROMPTU_STATUS_OK; }\n")
        .unwrap();
    let languages: [(Command, &[&str]); 5] = [
        (Machine::Host.compiler(), &["-std=c99"]),
        (Machine::Host.compiler(), &["-std=c11"]),
        (Machine::Board.compiler(), &["-std=c99"]),
        // Enumerations of other sizes must not change the interface.
        (Machine::Board.compiler(), &["-std=gnu11", "-fno-short-enums"]),
        (Command::new("c++"), &["-x", "c++", "-std=c++11"]),
    ];
    for (mut compiler, language) in languages {
        c::finished(compiler.args(language).args(c::STRICT).arg("-I").arg(c::include()).arg("-fsyntax-only").arg(&source))
            .unwrap();
    }
}

/// What the C program reads, and what it must answer: the recorded flight, flown again with numbers as they cross the C face.
fn script(file: &[u8]) -> (Vec<u8>, Vec<u8>) {
    let model = Model::from_bytes(file).unwrap();
    let switches = |tick| match tick {
        1_003 => Some(Event::Lanes(Lanes::BOTH)),
        3_333 => Some(Event::Lanes(Lanes { network: false, feedback: true })),
        4_000 => Some(Event::Lanes(Lanes::NONE)),
        4_555 => Some(Event::Lanes(Lanes { network: true, feedback: false })),
        _ => None,
    };
    let recording = flight::fly(Some((&model, Lanes::NONE)), TICKS, switches).recording;
    let (header, records) = recording.split_first_chunk::<HEADER>().unwrap();
    let settings = Header::from_bytes(header).unwrap().settings;

    let mut flight = Flight::new(&settings).unwrap();
    flight.attach(&model, Lanes::NONE).unwrap();
    let rate = settings.rates.reference_hz();
    let mut adapter = Adapter::<DESIRED, MEASURED, REFERENCE>::new(&model, quadrotor::signals(), rate, &CAPS, PREVIEW).unwrap();
    adapter.defer();
    let mut preview = Preview::<DESIRED, PREVIEW>::new(quadrotor::END_RULES, 0);
    let mut scratch = Scratch::new();

    let (mut script, mut answers) = (Vec::new(), Vec::new());
    script.extend(TICKS.to_le_bytes());
    script.extend((file.len() as u32).to_le_bytes());
    let impromptu_flight::control::Airframe { mass, inertia, rotors, directions, .. } = settings.airframe;
    let airframe =
        [settings.airframe.thrust_coefficient, settings.airframe.torque_coefficient, settings.airframe.max_rotor_speed];
    let position = settings.position;
    floats(&mut script, [mass].iter().chain(&inertia).chain(rotors.as_flattened()).chain(&directions).chain(&airframe));
    floats(&mut script, position.kp.iter().chain(&position.kd).chain(&position.ki).chain([&position.integral_limit]));
    floats(&mut script, &[settings.attitude.kp, settings.attitude.kd, settings.rates.control_hz]);
    script.extend(settings.rates.position_divisor.to_le_bytes());
    script.extend(file);

    let (mut lanes, mut setpoints, mut tick) = (0u32, Vec::new(), 0);
    for record in records.as_chunks::<RECORD>().0 {
        let event = Event::from_bytes(record).unwrap();
        event.prepare(&mut flight);
        match event {
            Event::Lanes(Lanes { network, feedback }) => {
                lanes = 4 | u32::from(network) | u32::from(feedback) << 1;
                adapter.switch(Lanes { network, feedback });
            }
            Event::Setpoint(setpoint) => {
                setpoints.push(quadrotor::desired(&setpoint));
                preview.push(quadrotor::desired(&setpoint));
            }
            Event::Tick(state) => {
                script.extend(lanes.to_le_bytes());
                script.extend((setpoints.len() as u32).to_le_bytes());
                setpoints.iter().for_each(|setpoint| floats(&mut script, setpoint));
                (lanes, setpoints) = (0, Vec::new());
                let q = state.attitude.quaternion();
                let attitude = [q.w, q.i, q.j, q.k];
                let (p, v, w): ([f32; 3], [f32; 3], [f32; 3]) =
                    (state.position.into(), state.velocity.into(), state.rates.into());
                let mut numbers = [0.0; 14];
                for (place, number) in numbers.iter_mut().zip(p.iter().chain(&v).chain(&attitude).chain(&w)) {
                    *place = *number;
                }
                floats(&mut script, &numbers);

                let state = State::from_raw(p, v, attitude, w).unwrap();
                let command = flight.step(Tick(tick), &state, &mut scratch);
                let reference = flight.reference();
                floats(&mut answers, &command.fractions());
                floats(&mut answers, reference.position.iter().chain(&reference.velocity).chain([&reference.yaw]));
                if tick.is_multiple_of(settings.rates.position_divisor) {
                    let reference_tick = (tick / settings.rates.position_divisor) as i32;
                    let measured = std::array::from_fn(|channel| numbers[channel]);
                    let reference = adapter.step(reference_tick, &preview, &measured, &mut scratch);
                    floats(&mut answers, reference.iter().chain(&adapter.correction()).chain(&adapter.weights()));
                    answers.extend(
                        [adapter.saturations(), adapter.late(), preview.next_tick() as u32].map(u32::to_le_bytes).as_flattened(),
                    );
                    let reach = preview.reach(reference_tick);
                    answers.extend([adapter.starved(), reach as u32].map(u32::to_le_bytes).as_flattened());
                    let trips = adapter.trips();
                    answers.extend([trips.network, trips.feedback].as_flattened().iter().flat_map(|count| count.to_le_bytes()));
                }
                tick += 1;
            }
            Event::Dither(_) | Event::End { .. } => {}
        }
    }
    assert_eq!(tick, TICKS);
    (script, answers)
}

fn floats<'a>(bytes: &mut Vec<u8>, numbers: impl IntoIterator<Item = &'a f32>) {
    numbers.into_iter().for_each(|number| bytes.extend(number.to_le_bytes()));
}

/// Runs a C program that reads a script: on the host, under sanitizers where the compiler has them, and on the emulated board.
/// Each must answer what is expected; `check` looks at what it prints.
fn answered_everywhere(prefix: &str, source: &str, script: &[u8], expected: &[u8], check: impl Fn(&str)) {
    let [host, board, watched, small] = ["host", "board", "watched", "watched-small"].map(|name| format!("{prefix}-{name}"));
    let mut machines = vec![(Machine::Host, host, &[][..]), (Machine::Board, board, &[])];
    machines.extend(c::sanitizers(&folder(&small)).map(|flags| (Machine::Host, watched, flags)));
    for (machine, name, flags) in machines {
        let folder = folder(&name);
        fs::write(folder.join("script.bin"), script).unwrap();
        let program = machine.program(&folder, flags, &[source]).unwrap();
        let printed = machine.run(&program, &folder, TIMEOUT).unwrap();
        let answers = fs::read(folder.join("answers.bin")).unwrap();
        let differs = answers.iter().zip(expected).position(|(a, b)| a != b);
        assert!(
            differs.is_none() && answers.len() == expected.len(),
            "{name}: byte {differs:?}, {} of {}",
            answers.len(),
            expected.len()
        );
        check(&printed);
        println!("{name}: {printed}");
    }
}

#[test]
fn a_c_program_gets_the_bits_of_rust_here_and_on_the_emulated_board() {
    let file = model::file(&model::TANH, Precision::Int8);
    let (script, expected) = script(&file);
    // The header's sizes are not much larger than needed: the caller pays for them.
    answered_everywhere("c", "flight.c", &script, &expected, |printed| {
        let sizes: serde_json::Value = serde_json::from_str(printed).unwrap();
        assert!(sizes["adapter"].as_u64().unwrap() > 12_288, "{sizes}");
    });
}

/// Makes so many random calls, under sanitizers where the compiler has them.
fn call_at_random(name: &str, seed: u32, calls: u32) {
    let folder = folder(name);
    fs::write(folder.join("model.bin"), model::file(&model::TANH, Precision::Int8)).unwrap();
    let (seed, calls) = (format!("-DSEED={seed}u"), format!("-DCALLS={calls}u"));
    let flags = [&[&*seed, &calls], c::sanitizers(&folder).unwrap_or_default()].concat();
    let program = Machine::Host.program(&folder, &flags, &["calls.c"]).unwrap();
    let report = Machine::Host.run(&program, &folder, TIMEOUT).unwrap();
    println!("{report}");
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    // Neither a test of refusals alone, nor of lanes that never came.
    let counts = ["done", "refused", "corrected", "faded_in"].map(|count| report[count].as_u64().unwrap());
    assert!(counts.iter().all(|count| *count > 0) && counts[0] > u64::from(CALLS) / 4, "{report}");
}

#[test]
fn random_calls_from_c_are_done_or_refused_and_harm_nothing() {
    call_at_random("c-calls-1", 1, CALLS);
    call_at_random("c-calls-2", 2, CALLS);
}

#[test]
#[ignore = "long"]
fn long_forty_times_as_many_random_calls_from_c_are_done_or_refused() {
    call_at_random("c-calls-long", 3, 80 * CALLS);
}

/// The model as the example's Kbuild file puts it into the program.
fn model_source(folder: &Path, file: &[u8]) -> PathBuf {
    let (model, source) = (folder.join("flown.model"), folder.join("model.s"));
    fs::write(&model, file).unwrap();
    let kbuild = fs::read_to_string(c::crate_folder().join("examples/crazyflie/src/Kbuild")).unwrap();
    let line = kbuild.lines().find(|line| line.contains("printf '")).unwrap();
    let text = line.split('\'').nth(1).unwrap().replace("\\n", "\n").replace("%s", model.to_str().unwrap());
    fs::write(&source, text).unwrap();
    source
}

/// Bytes of stack that each call may need on the microcontroller; the header and the Crazyflie's example tell these.
#[test]
fn calls_from_c_need_no_more_stack_than_the_header_says() {
    let folder = folder("c-stack");
    let source = model_source(&folder, &model::file(&model::TANH, Precision::Int8));
    let program = Machine::Board.program(&folder, &[], &["stack.c", source.to_str().unwrap()]).unwrap();
    let used = Machine::Board.run(&program, &folder, TIMEOUT).unwrap();
    println!("{used}");
    let used: serde_json::Map<String, serde_json::Value> = serde_json::from_str(&used).unwrap();
    let header = fs::read_to_string(c::include().join("impromptu.h")).unwrap();
    for (call, kilobytes) in [
        ("model_create", 4),
        ("adapter_create", 4),
        ("flight_attach", 4),
        ("flight_control", 4),
        ("learner_create", 8),
        ("learner_step", 8),
        ("learner_keep", 4),
        ("learner_recall", 8),
    ] {
        let prototype = header.find(&format!("impromptu_{call}(")).unwrap();
        let comment = &header[header[..prototype].rfind("\n\n").unwrap()..prototype];
        assert!(comment.contains(&format!("{kilobytes} KB of stack")), "{call}: {comment}");
    }
    crazyflie::its_app_task_has_room(used["learner_create"].as_u64().unwrap());
    for (call, bytes) in &used {
        let limit = match call.as_str() {
            "model_create" | "flight_control" | "adapter_create" | "flight_attach" | "learner_keep" => 4_096,
            "learner_create" | "learner_recall" | "commissioning" => 8_192,
            _ => 2_048,
        };
        assert!(bytes.as_u64().unwrap() <= limit, "{call} needs {bytes} bytes of stack");
    }
}
