//! Other simulators beside ours: the benchmarks are in `benches/`.
