//! x
use hil_sim::*;
use protocol::Role;
fn main() {
    let d = std::path::PathBuf::from("target/thumbv7em-none-eabihf/release");
    let f = elf::Firmwares { sensor: elf::Firmware::read(&d.join("firmware-sensor"), Role::Sensor).unwrap(), display: elf::Firmware::read(&d.join("firmware-display"), Role::Display).unwrap() };
    let mut s = scene::Scene::constant(2.0, 50.0);
    s.duration_s = std::env::args().nth(1).map_or(1.0, |a| a.parse().unwrap());
    let (r, facts) = match elf::run(&s, &f) { Ok(x) => x, Err(e) => { println!("{e}"); return } };
    println!("{facts:?} wall {} hash {:x} scans {} ticks {} est {} out {}", r.wall_s, r.hash, r.scans.len(), r.ticks.len(), r.estimates.len(), r.outputs.len());
    println!("{:?}\n{:?}", r.sensor_status, r.display_status);
    for l in &r.log { println!("{l:?}"); }
    for e in r.estimates.iter().take(40).step_by(3) { println!("{e:?}"); }
    for o in r.outputs.iter().take(3) { println!("{o:?}"); }
    println!("{:?}", r.scans.first()); println!("{:?}", r.ticks.first());
    let world = world::World::new(&s).unwrap();
    let wl = |x: f64| world.wavelength_mm(x);
    let t = truth::Truth { sensor: s.sensor_configuration(), display: s.display_configuration(), ..truth::Truth::new(&s.name, "counting", &wl) };
    let v = analysis::judge(&t, &r);
    println!("{:#?} {:#?}", v.summary, v.actuators);
}
