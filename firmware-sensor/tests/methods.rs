//! How good each method is on synthetic rubs.

mod rubbing;

use protocol::Method;
use rubbing::{Judgement, Motion, Rub, with};

fn show(name: &str, method: Method, rubs: &[Rub]) -> Judgement {
    let mut worst = Judgement {
        valid_share: 1.0,
        ..Judgement::default()
    };
    let (mut mean, mut mean_valid) = (0.0, 0.0);
    let mut amp = (f64::MAX, 0.0f64);
    for rub in rubs {
        let j = rub.judge(with(method));
        mean += j.rms_percent / rubs.len() as f64;
        worst.rms_percent = worst.rms_percent.max(j.rms_percent);
        worst.worst_percent = worst.worst_percent.max(j.worst_percent);
        worst.valid_share = worst.valid_share.min(j.valid_share);
        mean_valid += j.valid_share / rubs.len() as f64;
        worst.wrong_share = worst.wrong_share.max(j.wrong_share);
        amp = (amp.0.min(j.amplitude_lsb), amp.1.max(j.amplitude_lsb));
    }
    println!(
        "{name:28} {:>9} rms mean {mean:6.2} max {:6.2} worst {:7.2} valid {mean_valid:.3} {:.3} wrong {:.4} amp {:.0}..{:.0}",
        format!("{method:?}"),
        worst.rms_percent,
        worst.worst_percent,
        worst.valid_share,
        worst.wrong_share,
        amp.0,
        amp.1
    );
    worst
}

fn table_1(change: impl Fn(&mut Rub)) -> Vec<Rub> {
    let mut rubs = vec![];
    for speed in [30.0, 50.0, 70.0] {
        for wavelength_mm in [1.0, 2.0, 3.0, 4.0] {
            let mut rub = Rub::new(Motion::Constant(speed), wavelength_mm);
            change(&mut rub);
            rubs.push(rub);
        }
    }
    rubs
}

fn strokes(motion: Motion, wavelengths: &[f64], change: impl Fn(&mut Rub)) -> Vec<Rub> {
    wavelengths
        .iter()
        .map(|w| {
            let mut rub = Rub::new(motion, *w);
            rub.duration_s = 6.0;
            change(&mut rub);
            rub
        })
        .collect()
}

#[test]
fn survey() {
    for method in [Method::Crossings] {
        for db in [40.0, 20.0, 10.0, 5.0, 0.0, -5.0, -10.0, -30.0] {
            show(&format!("table 1 {db} dB"), method, &table_1(|r| r.snr_db = Some(db)));
        }
        for db in [10.0, 0.0, -10.0] {
            show(&format!("2 Hz {db} dB"), method, &strokes(Motion::Sinusoid(70.0, 2.0), &[1.0, 2.0, 3.0, 4.0], |r| r.snr_db = Some(db)));
        }
        show("table 1 dead 1", method, &table_1(|r| r.dead = vec![1]));
        show("table 1 dead 0 1", method, &table_1(|r| r.dead = vec![0, 1]));
        show("table 1 dead all but one", method, &table_1(|r| r.dead = vec![0, 1, 2, 3]));
        show("table 1 dead all", method, &table_1(|r| r.dead = vec![0, 1, 2, 3, 4]));
        show("table 1 saturated 2", method, &table_1(|r| r.saturated = vec![2]));
        show("table 1 2nd harmonic .5", method, &table_1(|r| r.second_harmonic = 0.5));
        show("table 1 2nd harmonic 1", method, &table_1(|r| r.second_harmonic = 1.0));
        show("table 1 drift 2", method, &table_1(|r| r.drift = 2.0));
        show("fig 7", method, &strokes(Motion::Sinusoid(70.0, 0.83), &[2.0], |_| ()));
        show("fig 7 0 dB", method, &strokes(Motion::Sinusoid(70.0, 0.83), &[2.0], |r| r.snr_db = Some(0.0)));
        show("2 Hz 70 mm/s", method, &strokes(Motion::Sinusoid(70.0, 2.0), &[1.0, 2.0, 3.0, 4.0], |_| ()));
        show("5 Hz 70 mm/s", method, &strokes(Motion::Sinusoid(70.0, 5.0), &[1.0, 2.0, 3.0, 4.0], |_| ()));
        show("1 Hz 100 mm/s", method, &strokes(Motion::Sinusoid(100.0, 1.0), &[1.0, 2.0, 3.0, 4.0], |_| ()));
        show("0.2 Hz 100 mm/s", method, &strokes(Motion::Sinusoid(100.0, 0.2), &[1.0, 2.0, 3.0, 4.0], |_| ()));
        show("off grid", method, &strokes(Motion::Constant(50.0), &[0.8, 1.37, 2.71, 3.3, 5.0], |_| ()));
        show("slow 2.5 Hz", method, &strokes(Motion::Constant(10.0), &[4.0], |_| ()));
        show("fast 100 Hz", method, &strokes(Motion::Constant(100.0), &[1.0], |_| ()));
        show("fast 150 Hz", method, &strokes(Motion::Constant(150.0), &[1.0], |_| ()));
        show("fast 250 Hz", method, &strokes(Motion::Constant(250.0), &[1.0], |_| ()));
        show("mixed λ 1 2.3", method, &strokes(Motion::Sinusoid(70.0, 0.83), &[1.0, 2.3], |r| { let w = r.specimens[0].0; r.specimens = vec![(w, f64::NEG_INFINITY), (3.1, 13.0)]; }));
    }
}

#[test]
fn boundary() {
    for (from, to) in [(1.0, 4.0), (4.0, 1.0), (2.0, 3.0), (3.0,2.0), (1.0, 1.3), (4.0, 3.5)] {
        for speed in [70.0, 50.0] {
            let mut worst = 0.0f64;
            let mut wrong = 0;
            for seed in 0..10 {
                let mut rub = Rub::new(Motion::Constant(speed), from);
                rub.specimens.push((to, 60.0 + 0.1 * seed as f64));
                rub.seed = seed;
                let at_s = rub.specimens[1].1 / speed;
                for e in rub.estimates(with(Method::Crossings)) {
                    let t_s = e.instant_us as f64 / 1e6;
                    let truth = if t_s > at_s { to } else { from };
                    let error = e.wavelength_mm.unwrap_or(0.0) as f64 / truth - 1.0;
                    if t_s > at_s && error.abs() > 0.1 { worst = worst.max(t_s - at_s); }
                    if e.valid && error.abs() > 0.1 { wrong += 1; }
                    if seed == 0 && (t_s - at_s).abs() < 0.2 && speed == 70.0 { print!("{:.2}{} ", e.wavelength_mm.unwrap_or(0.0), if e.valid {""} else {"?"}); }
                }
            }
            println!("{from} -> {to} at {speed}: settled after {:.0} ms, valid but wrong {} ms a boundary", worst * 1e3, wrong);
        }
    }
}
