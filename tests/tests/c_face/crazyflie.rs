//! The example for the Crazyflie in a small firmware that stands for its own: it learns, it obeys, it is small.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use impromptu_flight::quadrotor::MEASURED;
use impromptu_tests::c::{self, Machine};
use object::{Object, ObjectSection, ObjectSymbol};

use super::{TIMEOUT, folder};

const SOURCES: [&str; 3] = ["controller_impromptu.c", "plan.c", "work.c"];
/// Bytes of all statics that the example may have where nothing but what is learned corrects.
const STATICS: u64 = 12 * 1024;

fn example() -> PathBuf {
    c::crate_folder().join("examples/crazyflie")
}

/// As the Crazyflie's firmware is compiled.
fn flags() -> Vec<String> {
    let (sources, interface) = (example().join("src"), c::programs().join("crazyflie-interface"));
    let folders = [&sources, &interface].map(|path| format!("-I{}", path.display()));
    let names = ["-std=gnu11", "-fno-math-errno", "-DIMPROMPTU_SHIFT_YAW"].map(str::to_owned);
    names.into_iter().chain(folders).collect()
}

/// What its app task calls with the most on the stack is the creation of learners, in frames of its own and beside what an
/// interrupt puts there.
pub(crate) fn its_app_task_has_room(call: u64) {
    let config = fs::read_to_string(example().join("app-config")).unwrap();
    let words = config.lines().find_map(|line| line.strip_prefix("CONFIG_APP_STACKSIZE=")).unwrap();
    assert!(4 * words.parse::<u64>().unwrap() >= call + 600, "{words} words, and {call} bytes are needed");
    let page = fs::read_to_string(example().join("README.md")).unwrap();
    assert!(page.contains(&format!("App stack: {words} words")), "README.md of the example: {words} words");
}

/// Builds the flights, `count` of them, with more flags for the compiler; gives what they say.
fn fly(name: &str, count: u32, watched: &[&str]) -> serde_json::Value {
    let folder = folder(name);
    let own = flags();
    let flights = format!("-DFLIGHTS={count}");
    let flags: Vec<&str> =
        own.iter().map(String::as_str).chain([&*flights, "-Wl,--wrap=plan_is_disabled"]).chain(watched.iter().copied()).collect();
    let paths = ["plan.c", "work.c"].map(|source| example().join("src").join(source).to_str().unwrap().to_owned());
    let sources =
        [&["crazyflie.c", "crazyflie-firmware/firmware.c", "crazyflie-firmware/planner.c"][..], &[&paths[0], &paths[1]]];
    let program = Machine::Host.program(&folder, &flags, &sources.concat()).unwrap();
    let report = Machine::Host.run(&program, &folder, TIMEOUT).unwrap();
    println!("{report}");
    let bytes = fs::read(folder.join("answers.bin")).unwrap();
    let measured: Vec<f32> = bytes.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    // Rolled to the right, nose up, turned to the right; rates about right-handed axes.
    assert_eq!(measured.len(), MEASURED);
    assert_eq!(measured[..6], [0.01, 0.02, 1.03, 0.4, -0.2, 0.1]);
    let turns = [20.0f32, -10.0, -30.0, 90.0, -45.0, 180.0].map(f32::to_radians);
    assert!(measured[6..12].iter().zip(turns).all(|(a, b)| (a - b).abs() < 1e-6), "{measured:?}");
    assert_eq!(measured[12], 0.5 * 9.81);
    serde_json::from_str(&report).unwrap()
}

/// Each flight ends by LAND, STOP, a low battery, a lost link or a streamed set-point at a moment that is drawn; the program
/// says where the example does not do as the firmware without it.
fn it_learns_and_obeys(name: &str, flights: u32) {
    let report = fly(name, flights, c::sanitizers(&folder("c-crazyflie-small")).unwrap_or_default());
    let number = |key: &str| report[key].as_f64().unwrap();
    assert!(number("last") < 0.15 * number("stock") && number("stock") > 0.2, "{report}");
    // Not a test of flights in which there was no correction to be taken away.
    assert!(number("orders") == f64::from(flights) && number("lasting") > 100.0 && number("most") > 0.3, "{report}");
}

#[test]
fn the_crazyflie_learns_in_flight_and_obeys_as_without_the_add_on() {
    it_learns_and_obeys("c-crazyflie", 200);
}

#[test]
#[ignore = "long"]
fn long_the_crazyflie_obeys_in_ten_thousand_flights() {
    it_learns_and_obeys("c-crazyflie-long", 10_000);
}

/// Compiles the example as the firmware does, each file by itself.
fn objects(folder: &Path) -> Vec<PathBuf> {
    let compile = |source: &str| {
        let object = folder.join(source).with_extension("o");
        let mut compiler = Machine::Board.compiler();
        compiler
            .args(["-Os", "-Werror", "-Wall", "-Wdouble-promotion", "-mfp16-format=ieee", "-fstack-usage", "-c"])
            .args(flags());
        c::finished(compiler.arg("-I").arg(c::include()).arg(example().join("src").join(source)).arg("-o").arg(&object)).unwrap();
        object
    };
    SOURCES.iter().map(|source| compile(source)).collect()
}

/// What is not used costs nothing: without a model there is no memory for one.
#[test]
fn the_crazyflies_statics_and_the_stabilizers_stack_are_as_small_as_its_page_says() {
    let folder = folder("c-crazyflie-sizes");
    let mut statics = 0;
    let mut frames = BTreeMap::new();
    for object in objects(&folder) {
        let bytes = fs::read(&object).unwrap();
        let file = object::File::parse(&*bytes).unwrap();
        // The tables of parameters and logs are the stand-ins'; the firmware has them in flash.
        let counts = |name: &str| [".bss", ".data"].iter().any(|kind| name.starts_with(kind)) && !name.contains("s_impromptu");
        statics += file.sections().filter(|s| s.name().is_ok_and(counts)).map(|s| s.size()).sum::<u64>();
        assert!(file.symbols().all(|symbol| symbol.name() != Ok("impromptu_model_create")), "a model that nobody gave");
        let usage = fs::read_to_string(object.with_extension("su")).unwrap();
        for line in usage.lines() {
            let mut words = line.split('\t');
            let name = words.next().unwrap().rsplit(':').next().unwrap().to_owned();
            frames.insert(name, words.next().unwrap().parse::<u64>().unwrap());
        }
    }
    println!("{statics} bytes of statics; {frames:?}");
    assert!(statics <= STATICS, "{statics} bytes of statics");
    let page = fs::read_to_string(example().join("README.md")).unwrap();
    assert!(page.contains(&format!("{statics} bytes of statics")), "README.md of the example: it has {statics} bytes of statics");
    // All of what the stabilizer task runs of ours: none of it calls the library.
    let names =
        ["controllerOutOfTree", "exchange", "is_to_correct", "plan_is", "plan_copy", "measure", "add", "correct", "shake"];
    let deepest: u64 = names.iter().filter_map(|name| frames.get(*name)).sum();
    assert!(deepest > 0 && deepest <= 500, "{deepest} bytes of the stabilizer's stack");
}

/// The make file's test of what was linked: a commander that does not call what is wrapped is found.
#[test]
fn a_firmware_whose_commander_does_not_call_what_is_wrapped_is_refused() {
    let folder = folder("c-crazyflie-wrap");
    let check = |calls: bool| {
        let (source, elf) = (folder.join("commander.c"), folder.join("cf2.elf"));
        let call = if calls { "plan_is_disabled(0)" } else { "0" };
        let text = format!("#include \"planner.h\"\nint main(void);\nint main(void) {{ return {call}; }}\n");
        fs::write(&source, text).unwrap();
        let mut compiler = Machine::Host.compiler();
        compiler.args(flags()).arg("-I").arg(c::include()).args([
            "-ffunction-sections",
            "-Wl,--gc-sections",
            "-Wl,--wrap=plan_is_disabled",
        ]);
        let plan = example().join("src/plan.c");
        let stand_in = c::programs().join("crazyflie-firmware/firmware.c");
        compiler
            .arg(&source)
            .arg(plan)
            .arg(c::programs().join("crazyflie-firmware/planner.c"))
            .arg(stand_in)
            .arg("-I")
            .arg(c::programs());
        c::finished(compiler.args(["-lm", "-o"]).arg(&elf)).unwrap();
        Command::new(example().join("check.sh")).arg(&folder).arg("plan_is_disabled").env("CROSS_COMPILE", "").output().unwrap()
    };
    assert!(check(true).status.success());
    let refused = check(false);
    let said = String::from_utf8(refused.stderr).unwrap();
    assert!(!refused.status.success() && said.contains("does not call plan_is_disabled any more"), "{said}");
}

/// A make file that stops says what to give.
#[test]
fn a_model_that_is_missing_is_named() {
    let folder = folder("c-crazyflie-model");
    let kbuild = example().join("src/Kbuild");
    let make = |model: &str| {
        let mut make = Command::new("make");
        make.arg("-n").arg("-f").arg(&kbuild).arg(format!("IMPROMPTU_MODEL={model}")).args(["CC=cc", "obj=o", "OOT=t", "FORCE"]);
        make.current_dir(&folder).output().unwrap()
    };
    assert!(make("").status.success());
    let refused = make("/no/such.model");
    let said = String::from_utf8(refused.stderr).unwrap();
    assert!(!refused.status.success() && said.contains("IMPROMPTU_MODEL: /no/such.model does not exist"), "{said}");
}
