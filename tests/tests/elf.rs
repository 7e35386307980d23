use impromptu_tests::{elf::Elf, emulator::build_firmware};
#[test]
fn explore() {
    for (p, b) in [("impromptu-planted", "planted"), ("impromptu-firmware", "netduinoplus2"), ("impromptu-firmware", "kernels")] {
        let elf = build_firmware(p, b, &[]).unwrap();
        let mut elf = Elf::read(&elf).unwrap();
        if b != "planted" {
            for n in ["float_kernel", "float_six_kernel", "cortex_m4::int8", "cortex_m4::int16"] {
                elf.declare_labels(n).unwrap();
            }
        }
        let t = std::time::Instant::now();
        let graph = elf.call_graph().unwrap();
        println!("== {b} {:?}", t.elapsed());
        println!("{}", elf.footprint(&[]).unwrap().table(12));
        let all = graph.from_roots(&["Reset"]).unwrap();
        for f in all.flaws() {
            println!("FLAW {f}");
        }
        for f in all.indirect() {
            println!("IND {f}");
        }
        for f in all.panics() {
            println!("PANIC {f}");
        }
        for f in all.double_precision() {
            println!("F64 {f}");
        }
        for f in all.recursion() {
            println!("REC {f:?}");
        }
        if b == "netduinoplus2" {
            let p = graph.from_roots_except(&["replay::step"], &["math::sin", "math::cos"]).unwrap();
            println!(
                "BOUND {:?} {:?}",
                graph.from_roots(&["replay::step"]).unwrap().stack_path(),
                graph.stack_along(&["main", "__cortex_m_rt_main", "replay::fly", "replay::step"])
            );
            println!("STEP {:?} {:?}", p.stack_bytes(), p.stack_path());
            println!("{:#?}", p.reached());
            println!("{:#?} {:#?} {:#?} {:#?} {:#?}", p.panics(), p.double_precision(), p.flaws(), p.indirect(), p.recursion());
        }
    }
}
