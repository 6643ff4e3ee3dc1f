use std::time::{Duration, Instant};
fn main() {
    let mut bench = tests::fake_bench::FakeBench::new();
    bench.sensing.stream_gauges = std::env::args().nth(1).is_some();
    for (p, l) in [
        (bench.sensor.path(), "/tmp/fb-sensor"),
        (bench.display.path(), "/tmp/fb-display"),
    ] {
        let _ = std::fs::remove_file(l);
        std::os::unix::fs::symlink(p, l).unwrap();
    }
    let mut next = Instant::now();
    loop {
        bench.step();
        next += Duration::from_millis(2);
        std::thread::sleep(next.saturating_duration_since(Instant::now()));
    }
}
