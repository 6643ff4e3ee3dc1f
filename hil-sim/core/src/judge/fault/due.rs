//! What a scene asks of its faults: which have to show, and when the display has to drive again.

use protocol::{HELLO_LENGTH, Role};

use crate::plant::motion::MM_PER_COUNT;
use crate::scene::fault::catalogue::Needs;
use crate::scene::fault::{Class, Fault, Kind, Sign, nanoseconds};
use crate::scene::{Follows, Gauges, Kinematic, Link, Profile, Scene};

/// What a fault leaves shows so much later still: counters are told once a second.
pub(super) const LINGERS_NS: u64 = 1_050_000_000;
/// No hand is faster (docs' safety page).
const FASTEST_HAND_MM_S: f64 = 2_000.0;
/// At slower hands an encoder or a converter that stands still is told later than the table has it, or never.
const TOLD_MM_S: f64 = 12.0;
/// A dead encoder is told once an arm has moved so fast, in mm/s, for so long in s without its hand (docs' safety page),
/// and a tenth of a second for what is said of it.
const CONTRADICTS_MM_S: f64 = 10.0;
const CONTRADICTED_S: f64 = 3.1;
/// What an arm is told that its encoder says stands still (docs' safety page): the hand's velocity, and so much for each
/// mm to the hand, in 1/s. Less than this part of full speed is not counted. That it does not move has to be told once it
/// adds up to a fifth more than what full speed makes in this time.
const POSITION_GAIN_PER_S: f64 = 10.0;
const WEAK_PART: f64 = 0.05;
const STALLED_S: f64 = 0.05 * 1.2;
/// Waves that have to pass for a sound sensor to stand by a λ (docs' estimation page): on a plain surface, and on one where
/// that takes as many as a fit has at most. And for a gauge that says nothing to be missed.
const KNOWN_WAVES: f64 = 3.0;
const MOST_WAVES: f64 = 8.0;
const MISSED_WAVES: f64 = 1.0;
/// What is at the mains' frequency may be hum for so long, in s (docs' page on limits). Weak hum may take longer.
const HUM_S: f64 = 0.5;
/// Power of a plain surface over its noise, in dB.
const PLAIN_DB: f64 = 20.0;
/// A watchdog bites within so long (the table's `sensor-crash`), and a board that was reset runs within so long, in s.
const BITES_S: f64 = 0.52;
pub(super) const STARTS_S: f64 = 0.3;
/// In so many ms an arm's encoder is looked at, and what a link may take for it not to matter.
const SAMPLE_MS: f64 = 1.0;
const PROMPT_MS: f64 = 20.0;
/// An arm's encoder need not be called jumping below this, in mm (docs' safety page).
const LEAST_JUMP_MM: f64 = 1.0;
/// Share of the bytes from which on a corrupt frame is certain: one in ten frames.
const CORRUPT_SHARE: f64 = 1e-3;

/// What the link of a scene makes boards count by itself.
pub(super) fn weather_signs(link: &Link) -> Vec<Sign> {
    let corrupt = ["corrupt", "overlong", "malformed"];
    let reordered = ["late", "implausible"];
    let of_corrupt = corrupt.iter().filter(|_| link.corrupt > 0.0);
    let of_reordered = reordered.iter().filter(|_| link.reorder > 0.0);
    let counters = of_corrupt.chain(of_reordered);
    counters
        .flat_map(|&name| [Role::Sensor, Role::Display].map(|role| Sign::Counted(role, name)))
        .collect()
}

/// Whether boards that greet each other once a second may still do so by then, for all that the link lets through. The
/// first time is while they start.
pub(super) fn may_still_greet(link: &Link, until_s: f64) -> bool {
    /// A board greets within so long of its start, and has its answer a way there and back later.
    const BEGINS_S: f64 = 0.02;
    let answered_s = BEGINS_S + 2e-3 * (link.delay_ms + link.jitter_ms);
    if until_s < answered_s {
        return true;
    }
    /// A Hello's frame, in bytes.
    const HELLO_BYTES: f64 = HELLO_LENGTH as f64 + 8.0;
    const PERIOD_S: f64 = 1.0;
    const NEGLIGIBLE: f64 = 1e-3;
    let arrives = (1.0 - link.loss) * (1.0 - link.corrupt).powf(HELLO_BYTES);
    let tries = (until_s / PERIOD_S).floor() + 1.0;
    (1.0 - arrives * arrives).powf(tries) > NEGLIGIBLE
}

/// Whether it is a Stop that is said while nothing that is said arrives.
pub(super) fn is_unheard(fault: &Fault, scene: &Scene) -> bool {
    let cuts = |other: &Fault| other.kind.cuts_wire() && other.is_on(fault.begins_ns());
    fault.kind == Kind::StopFromPeer && scene.faults.iter().any(cuts)
}

/// Whose board a fault breaks.
pub(super) fn board_of(fault: &Fault) -> Role {
    match fault.kind.row().class {
        Class::Sensor => Role::Sensor,
        _ => Role::Display,
    }
}

/// Since when, in ns, the board that it breaks may have no power when it begins, may just have got it, or may start again
/// after a crash: nothing is there to be broken, or to say so.
pub(super) fn away_since_ns(fault: &Fault, scene: &Scene) -> Option<u64> {
    let row = fault.kind.row();
    let role = board_of(fault);
    let needs_it = row.needs == Needs::Boards || matches!(row.class, Class::Stops | Class::Sensor);
    if !needs_it || fault.cuts_power(role) {
        return None;
    }
    let is_away = |other: &&Fault| {
        let away_s = match other.kind {
            Kind::SensorHang | Kind::SensorPanic | Kind::AdcStopped if role == Role::Sensor => {
                BITES_S
            }
            _ if other.cuts_power(role) => other.for_s.unwrap_or(0.0),
            _ => return false,
        };
        fault.at_s < other.at_s + away_s + STARTS_S
    };
    let others = earlier(fault, scene).filter(is_away);
    others.map(Fault::begins_ns).max()
}

/// Why another fault may hide what shows it.
pub(super) fn hidden(fault: &Fault, scene: &Scene) -> Option<&'static str> {
    let within_ms = fault.seen_within_ms().unwrap_or(0.0);
    let from_ns = fault.begins_ns();
    let shows_ns = from_ns + nanoseconds(within_ms * 1e-3);
    let beside = |is_one: fn(Kind) -> bool| {
        let mut others = scene.faults.iter().filter(|other| *other != fault);
        others.any(|other| {
            is_one(other.kind)
                && other.begins_ns() < shows_ns
                && other.ends_ns().is_none_or(|end_ns| end_ns > from_ns)
        })
    };
    let is_of_gauge = matches!(fault.kind, Kind::GaugeOpen | Kind::GaugeShort);
    let is_felt = is_of_gauge || fault.kind == Kind::AdcStuck;
    if fault.kind.is_on_link() && beside(Kind::cuts_wire) {
        Some("nothing arrives there then")
    } else if is_of_gauge && beside(|kind| matches!(kind, Kind::AdcStuck | Kind::AdcStopped)) {
        Some("the converter tells nothing new then")
    } else if is_felt && scene.arm.follows == Follows::Link && may_be_at_rest(fault, scene) {
        Some("the arm may be at rest")
    } else {
        None
    }
}

/// Whether a fault is one that has to be seen: as long as its kind usually is, and no less than what can be told from
/// a sound board.
pub(super) fn must_show(fault: &Fault, scene: &Scene) -> bool {
    let row = fault.kind.row();
    let usual_s = row.lasts.default_s().unwrap_or(row.watch_s);
    let is_long = fault.for_s.is_none_or(|for_s| for_s >= usual_s);
    let value = fault.values[0];
    is_long
        && match fault.kind {
            // Two ticks' travel of the fastest hand that is taken for one.
            Kind::HandEncoderJump => value * MM_PER_COUNT > 2.0 * farthest_mm(scene),
            Kind::HandEncoderDead => scene.arm.follows == Follows::Motion,
            // And what an arm goes meanwhile, which is less than once more as far.
            Kind::ArmEncoderJump => {
                value * MM_PER_COUNT > LEAST_JUMP_MM + 2.0 * FASTEST_HAND_MM_S * SAMPLE_MS * 1e-3
            }
            Kind::LinkCorrupt => value >= CORRUPT_SHARE,
            _ => true,
        }
}

/// How far the fastest hand goes in a tick, in mm.
fn farthest_mm(scene: &Scene) -> f64 {
    FASTEST_HAND_MM_S / f64::from(scene.display_configuration().update_rate.hz())
}

/// Whether ticks stand for so long that the hand goes further from the one before to the one after than any does within
/// one, to a count: its encoder seems to jump. A watchdog's reset begins to count anew.
pub(super) fn goes_far(fault: &Fault, scene: &Scene) -> bool {
    let tick_s = 1.0 / f64::from(scene.display_configuration().update_rate.hz());
    let stands_s = fault.for_s.filter(|&for_s| for_s < BITES_S);
    let goes_mm = |stands_s: f64| {
        let [from_mm, to_mm] =
            [-tick_s, stands_s].map(|after_s| scene.motion.position_mm(fault.at_s + after_s));
        (to_mm - from_mm).abs()
    };
    fault.kind == Kind::TickStopped
        && stands_s.is_some_and(|s| goes_mm(s) + MM_PER_COUNT > farthest_mm(scene))
}

/// Whether the hand's encoder stands still while the arm, which its drive does not move, goes on.
pub(super) fn arm_goes_on(fault: &Fault, scene: &Scene) -> bool {
    fault.kind == Kind::HandEncoderDead && scene.arm.follows == Follows::Motion
}

/// Whether the hand is too slow for an encoder, a converter or a gauge that stands still to show in time: by its mean
/// speed, or where an arm that moves without it has to contradict it, by how long it moves faster than what counts.
pub(super) fn is_slow(fault: &Fault, scene: &Scene) -> bool {
    const PARTS: u32 = 1_000;
    let within_s = fault.seen_within_ms().unwrap_or(0.0) * 1e-3;
    let at_s = |part: u32| fault.at_s + within_s * f64::from(part) / f64::from(PARTS);
    let speeds = (0..PARTS).map(|part| scene.motion.velocity_mm_s(at_s(part)).abs());
    let is_slow = speeds.clone().sum::<f64>() < TOLD_MM_S * f64::from(PARTS);
    let contradicts_s = || {
        let parts = speeds.filter(|&speed| speed > CONTRADICTS_MM_S).count();
        within_s * parts as f64 / f64::from(PARTS)
    };
    match fault.kind {
        Kind::HandEncoderDead => is_slow || contradicts_s() < CONTRADICTED_S,
        Kind::AdcStuck => is_slow,
        Kind::GaugeOpen | Kind::GaugeShort => {
            let missed_s = felt_anew_s(scene, fault.at_s, MISSED_WAVES);
            is_slow || missed_s.is_none_or(|missed_s| missed_s > within_s)
        }
        _ => false,
    }
}

/// When the display has to drive again after a fault alone, in ns; none if it must not, or never ceases to. What the scene
/// leaves no time for is due after its end.
pub(super) fn again_ns(fault: &Fault, scene: &Scene) -> Option<u64> {
    let row = fault.kind.row();
    // An arm that is driven stands still from then on, and of one that is stopped the encoder is not looked at any more.
    let (is_of_arm, follows) = (fault.kind.is_of_arm(), scene.arm.follows == Follows::Link);
    let stands = is_of_arm && follows || (is_of_arm || follows) && arm_was_stopped(fault, scene);
    let ms = row.again_within_ms.filter(|_| !stands)?;
    let over_ns = fault.ends_ns().unwrap_or(fault.begins_ns());
    let anew_ms = match row.forgets {
        true => {
            let waves = if is_plain(scene) {
                KNOWN_WAVES
            } else {
                MOST_WAVES
            };
            let anew_s = felt_anew_s(scene, over_ns as f64 * 1e-9, waves);
            let hum_s = if has_hum(scene) { HUM_S } else { 0.0 };
            (anew_s.unwrap_or(scene.duration_s) + hum_s) * 1e3
        }
        false => 0.0,
    };
    Some(over_ns + nanoseconds(ms.max(anew_ms) * 1e-3))
}

/// Whether there is nothing on the surface, or in what is felt of it, that may make a sensor hesitate.
pub(super) fn is_plain(scene: &Scene) -> bool {
    let Gauges::Kinematic(kinematic) = &scene.gauges else {
        return false;
    };
    let besides_noise = Kinematic {
        snr_db: None,
        offset: 0.0,
        ..*kinematic
    };
    let irregularity = &scene.surface.irregularity;
    besides_noise == Kinematic::default()
        && kinematic.snr_db.is_none_or(|db| db >= PLAIN_DB)
        && irregularity.random + irregularity.second_wave + irregularity.worn == 0.0
        && matches!(scene.surface.profile, Profile::Sine | Profile::Trapezoid)
        && scene.contact.friction.is_none()
}

/// Whether there is hum, to be found anew before a wave can be stood by.
fn has_hum(scene: &Scene) -> bool {
    match &scene.gauges {
        Gauges::Kinematic(gauges) => gauges.hum_50_hz + gauges.hum_60_hz > 0.0,
        Gauges::Recorded(_) => false,
    }
}

/// How long after `from_s` so many waves have passed, in s, of ground that was not gone over since then; none if the scene
/// ends before.
fn felt_anew_s(scene: &Scene, from_s: f64, waves: f64) -> Option<f64> {
    const STEP_S: f64 = 1e-3;
    let place_mm = |step: u32| scene.motion.position_mm(from_s + STEP_S * f64::from(step));
    let (mut low_mm, mut high_mm, mut felt) = (place_mm(0), place_mm(0), 0.0);
    let steps = ((scene.duration_s - from_s) / STEP_S) as u32;
    let step = (1..=steps).find(|&step| {
        let x_mm = place_mm(step);
        let anew_mm = (x_mm - high_mm).max(low_mm - x_mm).max(0.0);
        felt += anew_mm / scene.surface.wavelength_mm(x_mm);
        (low_mm, high_mm) = (low_mm.min(x_mm), high_mm.max(x_mm));
        felt >= waves
    })?;
    Some(STEP_S * f64::from(step))
}

/// Whether the arm may rest when its encoder breaks, or is told too little for that to show in time.
pub(super) fn rests(fault: &Fault, scene: &Scene) -> bool {
    may_be_at_rest(fault, scene)
        || scene.link.delay_ms + scene.link.jitter_ms > PROMPT_MS
        || fault.kind == Kind::ArmEncoderDead && !is_told(fault, scene)
}

/// Whether what was before may have stopped an arm that its drive moves, for good or for now.
fn may_be_at_rest(fault: &Fault, scene: &Scene) -> bool {
    let power_ns = last_power_ns(fault, scene);
    let mut before = earlier(fault, scene);
    let may_rest = before
        .any(|other| other.ends_ns().unwrap_or(other.begins_ns()) + LINGERS_NS > fault.begins_ns())
        && power_ns.is_none_or(|power_ns| power_ns + LINGERS_NS < fault.begins_ns());
    arm_was_stopped(fault, scene) || may_rest
}

/// Whether what was before has stopped the arm for good, or may have.
fn arm_was_stopped(fault: &Fault, scene: &Scene) -> bool {
    let power_ns = last_power_ns(fault, scene);
    earlier(fault, scene)
        .filter(|other| power_ns.is_none_or(|power_ns| other.begins_ns() > power_ns))
        .any(|other| {
            other.kind.is_of_arm()
                || arm_goes_on(other, scene)
                || matches!(other.kind, Kind::StopFromPeer | Kind::StopFromConsole)
        })
}

/// When the sensor's power went last before a fault, in ns.
fn last_power_ns(fault: &Fault, scene: &Scene) -> Option<u64> {
    let power = earlier(fault, scene).filter(|other| other.cuts_power(Role::Sensor));
    power.map(Fault::begins_ns).max()
}

/// The others that have begun by then.
fn earlier<'a>(fault: &'a Fault, scene: &'a Scene) -> impl Iterator<Item = &'a Fault> {
    let is_earlier =
        move |other: &&Fault| *other != fault && other.begins_ns() <= fault.begins_ns();
    scene.faults.iter().filter(is_earlier)
}

/// Whether an arm whose encoder stands still from `fault` on is told to move so far in time that it has to be missed.
fn is_told(fault: &Fault, scene: &Scene) -> bool {
    const PARTS: u32 = 1_000;
    let part_s = fault.seen_within_ms().unwrap_or(0.0) * 1e-3 / f64::from(PARTS);
    let full_mm_s = f64::from(scene.sensor_configuration().arm_full_scale_um_s) * 1e-3;
    let stands_mm = scene.motion.position_mm(fault.at_s);
    let mut told_mm: f64 = 0.0;
    (0..PARTS).any(|part| {
        let t_s = fault.at_s + part_s * f64::from(part);
        let ahead_mm = scene.motion.position_mm(t_s) - stands_mm;
        let command_mm_s = scene.motion.velocity_mm_s(t_s) + POSITION_GAIN_PER_S * ahead_mm;
        if command_mm_s.abs() > WEAK_PART * full_mm_s {
            told_mm += command_mm_s.clamp(-full_mm_s, full_mm_s) * part_s;
        }
        told_mm.abs() > STALLED_S * full_mm_s
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boards_greet_while_they_start_and_no_more_where_all_arrives() {
        let link = Link::default();
        assert!(may_still_greet(&link, 0.0) && may_still_greet(&link, 0.012));
        assert!(!may_still_greet(&link, 0.021));
        let slow = Link {
            delay_ms: 300.0,
            ..link
        };
        assert!(may_still_greet(&slow, 0.61));
        assert!(!may_still_greet(&slow, 0.63));
    }

    #[test]
    fn an_arm_has_to_be_missed_where_it_is_told_to_go_far_enough_to_catch_up() {
        let rests_at = |speed_mm_s: f64, delay_ms: f64| {
            let fault = Fault::new(Kind::ArmEncoderDead, 0.5);
            let mut scene = Scene::constant(2.0, speed_mm_s);
            scene.faults = vec![fault];
            scene.link.delay_ms = delay_ms;
            rests(&fault, &scene)
        };
        // 12 mm in half a second. It is told 10 mm/s, and by then 60 mm/s, or 6 and 36, the weaker ones not counted.
        assert!(!rests_at(10.0, 0.0) && !rests_at(-10.0, 0.0));
        assert!(rests_at(6.0, 0.0));
        // A link that tells it late.
        assert!(!rests_at(10.0, 19.0) && rests_at(10.0, 21.0));
    }
}
