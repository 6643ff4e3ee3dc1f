mod felt;
use felt::*;
use protocol::SensorConfiguration;
const D: SensorConfiguration = SensorConfiguration::DEFAULT;
fn show(name: &str, e: &[protocol::Estimate], l: f64) {
    println!("== {name}");
    for c in e.chunks(10) {
        let (v, w) = valid_and_worst(c, l);
        let x = c[9];
        println!("{:.2}s valid {v:.1} worst {:.2}% conf {:.2} amp {:.0} λ {:?} used {:05b} {:?}", x.instant_us as f64/1e6, 100.0*w, x.confidence, x.amplitude_lsb, x.wavelength_mm, x.gauges_used, x.health);
    }
}
#[test]
fn sweep() {
    for (l, v1, v2) in [(1.0, 50.0, 60.0), (1.0,50.0,70.0), (1.5, 75.0, 30.0)] {
        let mut b = Bench::new(D);
        b.rub(500, |_| 30.0, texture(l));
        let e = b.rub(2000, |_| v1, texture(l));
        show(&format!("{l} at {v1}"), &e[150..], l);
        let e = b.rub(1500, |_| v2, texture(l));
        show(&format!("then at {v2}"), &e, l);
    }
}
#[test]
fn single() {
    for g in [1u8, 3, 7] { for v in [40.0, 45.0,48.0,50.0,52.0,55.0] {
        let mut b = Bench::new(SensorConfiguration{gauges:g, ..D});
        let e = b.rub(3000, |_| v, texture(1.0));
        let (s, w) = valid_and_worst(&e[50..], 1.0);
        println!("gauges {g:05b} v {v}: valid {s:.2} worst {:.2}% amp {}", 100.0*w, e[250].amplitude_lsb);
    }}
}
#[test]
fn strokes() {
    for l in [0.8,1.0,1.5,2.0,3.0,4.0] {
        let mut b = Bench::new(D);
        let e = b.rub(4000, |t| 70.0*(std::f64::consts::TAU*2.0*t).sin(), texture(l));
        let (s, w) = valid_and_worst(&e[50..], l);
        println!("stroke {l}: valid {s:.2} worst {:.2}% health {:?}", 100.0*w, e[399].health);
    }
}
