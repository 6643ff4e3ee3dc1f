//! Scenes drawn at random over nearly all keys, with faults at random instants: a sound pair has to come through each of
//! them as the table of faults says, and a scene within all bounds must not be refused.
//!
//! A scene is drawn as the text of its file, so that the reader is tried as well and a failing one can be kept.

use std::panic::{AssertUnwindSafe, catch_unwind};

use toml::{Table, Value};

use hil_sim_core::judge::fault::Finding;
use hil_sim_core::judge::outcome::{Judgement, Outcome};
use hil_sim_core::run::recording::Engine;
use hil_sim_core::scene::Scene;
use hil_sim_core::scene::fault::Kind;
use hil_sim_core::scene::fault::catalogue::{Key, Lasts, Needs};

use crate::bench::{Bench, BenchError};
use crate::jury::dice::Dice;

/// Both boards have greeted, and the stimulus can be on.
const STARTED_S: f64 = 0.6;

/// Draws what a section has.
type Filler = fn(&mut Section<'_>);

/// The sections of a scene, and what draws each.
const SECTIONS: [(&str, Filler); 8] = [
    ("surface", surface),
    ("motion", motion),
    ("arm", arm),
    ("contact", contact),
    ("gauges", gauges),
    ("link", link),
    ("estimator", estimator),
    ("display", display),
];

/// How scenes are drawn.
#[derive(Clone, Copy, Debug)]
pub struct Draw {
    /// What runs them: only the boards know all kinds of faults.
    pub engine: Engine,
    /// The most faults of a scene. One without any has a `nothing`, which must not show.
    pub most_faults: usize,
}

/// A drawn scene that was run.
#[derive(Clone, Debug)]
pub struct Trial {
    /// Its file's text.
    pub text: String,
    /// How many faults it has beside a `nothing`.
    pub faults: usize,
    /// How many things could not be judged.
    pub unjudged: usize,
    /// A line for each thing that is not as it should be.
    pub unmet: Vec<String>,
}

impl Trial {
    /// Runs the scene of this text, as the file `name`.toml has it. That it is refused, or can't be run, is a line of
    /// [`Trial::unmet`].
    pub fn run(name: &str, text: String, bench: &Bench) -> Self {
        let file = format!("{name}.toml");
        let judged = match Scene::parse(file.as_ref(), &text) {
            // One that panics must not take the others with it.
            Ok(scene) => catch_unwind(AssertUnwindSafe(|| judged(scene, bench)))
                .unwrap_or(Err(Unjudged::Panicked))
                .map_err(|error| error.to_string()),
            Err(refusal) => Err(refusal.to_string()),
        };
        let (findings, unmet) = match judged {
            Ok(judgement) => (judgement.findings, judgement.unmet),
            Err(reason) => (Vec::new(), vec![reason]),
        };
        let breaks = |finding: &&Finding| finding.fault.kind != Kind::Nothing;
        Self {
            text,
            faults: findings.iter().filter(breaks).count(),
            unjudged: findings.iter().map(|one| one.unjudged.len()).sum(),
            unmet,
        }
    }
}

/// Why a scene that was read was not judged.
#[derive(Debug, thiserror::Error)]
enum Unjudged {
    #[error(transparent)]
    Bench(#[from] BenchError),
    #[error("the simulator panicked")]
    Panicked,
}

fn judged(scene: Scene, bench: &Bench) -> Result<Judgement, Unjudged> {
    Ok(match bench {
        Bench::Native => Judgement::of(&scene, false).map_err(BenchError::from)?,
        Bench::Elf(_) => {
            let recording = bench.run(&scene)?;
            Outcome::new(scene, recording).judgement(false)
        }
    })
}

impl Draw {
    /// The text of the scene of `seed`.
    pub fn text(&self, seed: u64) -> String {
        // Each section has numbers of its own: a key more in one of them leaves the others as they are.
        let mut streams = 0..;
        let mut dice = || Dice::new(seed, streams.next().unwrap_or(0));
        let mut scene_dice = dice();
        let mut scene = Section::new(&mut scene_dice);
        scene.whole("seed", 1.0, 1e4);
        // On the boards a second takes as long as dozens natively.
        let longest_s = match self.engine {
            Engine::Native => 9.0,
            Engine::Elf => 4.5,
        };
        let duration_s = scene.number("duration_s", 2.5, longest_s);
        let mut table = scene.table;
        let faults = self.faults(&mut dice(), duration_s);
        table.insert("fault".to_owned(), Value::Array(faults));
        for (name, fill) in SECTIONS {
            let mut dice = dice();
            let mut section = Section::new(&mut dice);
            fill(&mut section);
            if !section.table.is_empty() {
                table.insert(name.to_owned(), Value::Table(section.table));
            }
        }
        // What takes the force channel.
        let mut dice = dice();
        let gauges = table.get("gauges").and_then(Value::as_table);
        if gauges.is_some_and(|gauges| gauges.contains_key("tangential")) {
            let mut put = |section: &str, key: &str, value: Value| {
                let section = table.entry(section);
                let section = section.or_insert_with(|| Value::Table(Table::new()));
                let section = section.as_table_mut().expect("it is a section");
                section.insert(key.to_owned(), value);
            };
            if dice.chance(0.2) {
                put("estimator", "stiffness", "estimated".into());
            }
            if dice.chance(0.4) {
                let reference_mn = dice.log_between(1.0, 2000.0).round() as i64;
                put("display", "reference_mn", reference_mn.into());
            }
        }
        toml::to_string(&table).expect("tables of numbers, words and lists")
    }

    fn faults(&self, dice: &mut Dice, duration_s: f64) -> Vec<Value> {
        let needs_no_board = |kind: &Kind| kind.row().needs == Needs::Nothing;
        let kinds: Vec<Kind> = match self.engine {
            Engine::Native => Kind::all().filter(needs_no_board).collect(),
            Engine::Elf => Kind::all().collect(),
        };
        let count = dice.below(self.most_faults + 1);
        let mut faults: Vec<Value> = (0..count)
            .map(|_| one_fault(kinds[dice.below(kinds.len())], duration_s, dice))
            .collect();
        if faults.is_empty() {
            faults.push(one_fault(Kind::Nothing, duration_s, dice));
        }
        faults
    }
}

fn one_fault(kind: Kind, duration_s: f64, dice: &mut Dice) -> Value {
    let mut section = Section::new(dice);
    section.word("kind", kind.name());
    section.number("at_s", STARTED_S, duration_s - 0.1);
    let row = kind.row();
    if row.lasts != Lasts::Once && section.dice.chance(0.4) {
        section.log("for_s", 0.02, 2.0);
    }
    for Key {
        name,
        default,
        low,
        high,
        whole,
        drawn,
        ..
    } in row.keys
    {
        // Most of the time what a campaign draws, which is large enough to have to show.
        let (low, high) = match drawn {
            Some(drawn) if section.dice.chance(0.7) => *drawn,
            _ => (*low, *high),
        };
        if section.dice.chance(0.6) {
            match whole {
                true => section.whole(name, low, high),
                // Wide ones reach over many powers of ten; those from 0 on, not so far beyond the default.
                false if low > 0.0 && high > 20.0 * low => section.log(name, low, high),
                false => section.number(name, low, high.min(20.0 * default.abs().max(0.05))),
            };
        }
    }
    Value::Table(section.table)
}

fn surface(to: &mut Section<'_>) {
    let count = match to.dice.uniform() {
        ..0.6 => 1,
        ..0.85 => 2,
        _ => 4,
    };
    let specimens = (0..count).map(|_| {
        let mut specimen = Section::new(to.dice);
        specimen.log("wavelength_mm", 0.6, 8.0);
        specimen.log("length_mm", 5.0, 200.0);
        Value::Table(specimen.table)
    });
    let specimens = Value::Array(specimens.collect());
    to.table.insert("specimens".to_owned(), specimens);
    to.maybe_word(0.4, "profile", &["sine", "trapezoid"]);
    to.maybe(0.2, "start_mm", -50.0, 50.0);
    to.maybe(0.25, "random", 0.0, 1.5);
    if to.dice.chance(0.2) {
        to.number("second_wave", 0.0, 1.0);
        to.maybe(0.7, "second_ratio", 0.2, 3.0);
    }
    to.maybe(0.15, "worn", 0.0, 0.5);
}

fn motion(to: &mut Section<'_>) {
    if to.dice.chance(0.5) {
        to.word("kind", "sinusoid");
        to.log("amplitude_mm_s", 5.0, 250.0);
        to.log("frequency_hz", 0.1, 6.0);
    } else {
        let backwards = to.dice.chance(0.4);
        let speed_mm_s = to.log("speed_mm_s", 1.0, 250.0);
        if backwards {
            to.put("speed_mm_s", -speed_mm_s);
        }
    }
}

fn arm(to: &mut Section<'_>) {
    if to.dice.chance(0.2) {
        to.word("follows", "link");
        to.maybe(0.7, "lag_ms", 0.0, 150.0);
    }
    if to.dice.chance(0.2) {
        let multiple = 1 + to.dice.below(10) as i64;
        to.table
            .insert("encoder_um".to_owned(), (5 * multiple).into());
    }
}

fn contact(to: &mut Section<'_>) {
    match to.dice.uniform() {
        ..0.65 => {}
        ..0.8 => {
            to.one_of("model", &["kinematic", "rigid", "viscoelastic"]);
        }
        _ => {
            to.maybe_word(0.5, "model", &["auto", "stick-slip"]);
            to.one_of("friction", &["mild", "strong", "severe"]);
        }
    }
}

fn gauges(to: &mut Section<'_>) {
    to.maybe(0.5, "snr_db", -5.0, 40.0);
    to.maybe(0.12, "hum_50_hz", 0.0, 2.0);
    to.maybe(0.12, "hum_60_hz", 0.0, 2.0);
    to.maybe(0.1, "hum_off_hz", -0.5, 0.5);
    to.maybe(0.2, "second_harmonic", 0.0, 1.0);
    if to.dice.chance(0.2) {
        let list = ["dead", "saturated", "stuck", "noisy", "humming"][to.dice.below(5)];
        let gauge = to.dice.below(5) as i64;
        let list_of_one = Value::Array(vec![gauge.into()]);
        to.table.insert(list.to_owned(), list_of_one);
        to.maybe(0.5, "trouble_from_s", 0.0, 2.4);
        to.maybe(0.5, "trouble_for_s", 0.1, 3.0);
    }
    to.maybe(0.15, "pink", 0.0, 1.0);
    to.maybe(0.15, "drift", 0.0, 2.0);
    to.maybe(0.15, "offset", 0.0, 8.0);
    if to.dice.chance(0.1) {
        to.log("resonance_hz", 30.0, 800.0);
        to.maybe(0.5, "resonance_damping", 0.05, 0.9);
    }
    to.maybe(0.1, "skew_us", -2000.0, 2000.0);
    if to.dice.chance(0.3) {
        to.table.insert("tangential".to_owned(), true.into());
        to.maybe(0.3, "tangential_n_per_v", 0.2, 5.0);
        to.maybe(0.3, "stiffness_n_per_m", 100.0, 2000.0);
    }
}

fn link(to: &mut Section<'_>) {
    if to.dice.chance(0.4) {
        to.log("delay_ms", 0.5, 300.0);
    }
    to.maybe(0.2, "jitter_ms", 0.0, 60.0);
    to.maybe(0.2, "loss", 0.0, 0.3);
    to.maybe(0.1, "reorder", 0.0, 0.3);
    to.maybe(0.1, "corrupt", 0.0, 0.01);
}

fn estimator(to: &mut Section<'_>) {
    if !to.dice.chance(0.25) {
        return;
    }
    if to.dice.chance(0.4) {
        to.whole("waves", 2.0, 8.0);
    }
    if to.dice.chance(0.4) {
        to.whole("valid_percent", 50.0, 95.0);
    }
    if to.dice.chance(0.3) {
        let left_out = to.dice.below(5);
        let all = (0..5).filter(|&gauge| gauge != left_out as i64);
        let list = Value::Array(all.map(Value::from).collect());
        to.table.insert("gauges".to_owned(), list);
    }
}

fn display(to: &mut Section<'_>) {
    to.maybe_word(0.7, "mode", &["uniform", "travelling"]);
    to.maybe_word(0.5, "rendering", &["fundamental", "shape", "texture"]);
    if to.dice.chance(0.3) {
        to.table.insert("update_rate_hz".to_owned(), 4000.into());
    }
    for (probability, name, low, high) in [
        (0.2, "amplitude_mv", 500.0, 5000.0),
        (0.1, "reference_lsb", 1.0, 1500.0),
        (0.15, "glide_ms", 0.0, 300.0),
        (0.15, "fade_in_ms", 1.0, 300.0),
        (0.15, "fade_out_ms", 1.0, 300.0),
        (0.1, "max_age_ms", 100.0, 2000.0),
        (0.1, "pitch_um", 100.0, 4000.0),
    ] {
        if to.dice.chance(probability) {
            to.whole(name, low, high);
        }
    }
}

/// A table of a scene's file that is being drawn.
struct Section<'a> {
    dice: &'a mut Dice,
    table: Table,
}

impl<'a> Section<'a> {
    fn new(dice: &'a mut Dice) -> Self {
        Self {
            dice,
            table: Table::new(),
        }
    }

    fn put(&mut self, key: &str, value: f64) {
        self.table.insert(key.to_owned(), Value::Float(value));
    }

    /// Uniform.
    fn number(&mut self, key: &str, low: f64, high: f64) -> f64 {
        let value = short(self.dice.between(low, high));
        self.put(key, value);
        value
    }

    /// Uniform in the logarithm.
    fn log(&mut self, key: &str, low: f64, high: f64) -> f64 {
        let value = short(self.dice.log_between(low, high));
        self.put(key, value);
        value
    }

    fn whole(&mut self, key: &str, low: f64, high: f64) -> f64 {
        let value = self.dice.between(low, high).round();
        self.table.insert(key.to_owned(), (value as i64).into());
        value
    }

    fn maybe(&mut self, probability: f64, key: &str, low: f64, high: f64) {
        if self.dice.chance(probability) {
            self.number(key, low, high);
        }
    }

    fn word(&mut self, key: &str, word: &str) {
        self.table.insert(key.to_owned(), word.into());
    }

    fn one_of(&mut self, key: &str, words: &[&str]) {
        let word = words[self.dice.below(words.len())];
        self.word(key, word);
    }

    fn maybe_word(&mut self, probability: f64, key: &str, words: &[&str]) {
        if self.dice.chance(probability) {
            self.one_of(key, words);
        }
    }
}

/// A number in four digits.
fn short(value: f64) -> f64 {
    let text = format!("{value:.3e}");
    text.parse().expect("a number was written")
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use hil_sim_core::scene::fault::Fault;

    use super::*;

    fn scenes(engine: Engine, seeds: u64) -> impl Iterator<Item = (String, Scene)> {
        let draw = Draw {
            engine,
            most_faults: 3,
        };
        (0..seeds).map(move |seed| {
            let text = draw.text(seed);
            let scene = Scene::parse("drawn.toml".as_ref(), &text);
            let scene = scene.unwrap_or_else(|refusal| panic!("{refusal}\n{text}"));
            (text, scene)
        })
    }

    #[test]
    fn every_scene_that_is_drawn_is_one() {
        for engine in [Engine::Native, Engine::Elf] {
            for (text, scene) in scenes(engine, 1000) {
                assert!((1..=3).contains(&scene.faults.len()), "{text}");
                let started = scene.faults.iter().all(|fault| fault.at_s >= STARTED_S);
                assert!(started, "{text}");
            }
        }
    }

    #[test]
    fn all_kinds_of_faults_come_and_natively_those_that_need_no_board() {
        let drawn = |engine| -> HashSet<Kind> {
            let faults = scenes(engine, 1000).flat_map(|(_, scene)| scene.faults);
            faults.map(|fault: Fault| fault.kind).collect()
        };
        assert_eq!(drawn(Engine::Elf), Kind::all().collect());
        let native = Kind::all().filter(|kind| kind.row().needs == Needs::Nothing);
        assert_eq!(drawn(Engine::Native), native.collect());
    }

    #[test]
    fn the_seed_decides_the_scene() {
        let texts = |engine| -> Vec<String> {
            let drawn = scenes(engine, 100);
            drawn.map(|(text, _)| text).collect()
        };
        assert_eq!(texts(Engine::Native), texts(Engine::Native));
        let different: HashSet<String> = texts(Engine::Native).into_iter().collect();
        assert_eq!(different.len(), 100);
    }

    #[test]
    fn what_is_refused_and_what_fails_is_told() {
        let run = |text: &str| {
            let trial = Trial::run("tried", text.to_owned(), &Bench::Native);
            (trial.faults, trial.unmet)
        };
        let (_, refused) = run("[surface]\n");
        assert!(
            refused[0].starts_with("tried.toml:1: surface.specimens: "),
            "{refused:?}"
        );
        let sound = "duration_s = 1.5\nsurface.specimens = [{ wavelength_mm = 2.0 }]\n[[fault]]\nkind = \"nothing\"\nat_s = 0.6\n";
        assert_eq!(run(sound), (0, Vec::new()));
        let (_, failed) = run(&format!("{sound}[expect]\nmean_mm = 3.0\n"));
        assert_eq!(failed.len(), 1, "{failed:?}");
        let (_, unfit) = run(&sound.replace("nothing", "panic"));
        assert!(unfit[0].contains("give --engine elf"), "{unfit:?}");
    }
}
