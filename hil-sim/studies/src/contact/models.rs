//! Speed against accuracy of the contact models: every rung of [`hil_sim_core::plant::contact`]'s ladder, and every
//! integrator of the rungs that are integrated, in steps of many lengths.
//!
//! Speed is of contact and gauges alone, without boards, in virtual seconds per second of one core. The
//! error is that of the five gauges' signals without noise: RMS of the difference to the reference's, as a
//! share of the reference's own RMS. Where the fingertip sticks and slips it is that of its place, as a
//! share of λ: a slip that comes a little early changes the signal by as much as there is of it.

pub mod picture;

use std::hint::black_box;
use std::time::{Duration, Instant};

use protocol::GAUGES;
use serde::Serialize;

use crate::study::{Short, Study, Table, csv_text, number};
use hil_sim_core::plant::contact::{Contact, EVENT_STEP_S};
use hil_sim_core::plant::gauges::{SCAN_RATE_HZ, Texture};
use hil_sim_core::plant::patch::Patch;
use hil_sim_core::plant::surface::Surface;
use hil_sim_core::scene;
use hil_sim_core::scene::Integrator;
use hil_sim_core::scene::{ContactModel, Friction, Motion, Scene, Solver, Specimen};

/// Steps of the integrators that take what they are told, in µs.
pub const STEPS_US: [f64; 8] = [250.0, 125.0, 50.0, 25.0, 10.0, 5.0, 2.0, 1.0];
/// Virtual time of a run, in s: ten slips and more.
const DURATION_S: f64 = 0.5;
/// A run is repeated for so long at least, and the fastest one counts: others have the machine, too.
const MEASURED: Duration = Duration::from_millis(60);

/// What is rubbed, and how.
#[derive(Clone, Debug)]
pub struct Case {
    /// In words.
    pub name: &'static str,
    scene: Scene,
}

/// A rung, solved in one way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entrant {
    /// The rung.
    pub rung: ContactModel,
    /// None if it is solved exactly, or from event to event.
    pub integrator: Option<Integrator>,
    /// Its step in µs; none if it chooses its own, or has none.
    pub step_us: Option<f64>,
}

/// What an entrant came to in a case.
#[derive(Clone, Debug)]
pub struct Row {
    /// The case's name.
    pub case: &'static str,
    /// Who.
    pub entrant: Entrant,
    /// Virtual seconds per second.
    pub pace: f64,
    /// RMS error in percent; none if it diverged.
    pub error_percent: Option<f64>,
}

/// The cases: a border, a hand that shakes, friction.
pub fn cases() -> Vec<Case> {
    let steady = Scene::constant(2.0, 50.0);
    let mut border = steady.clone();
    border.surface.specimens = [(1.0, 12.0), (4.0, f64::INFINITY)]
        .map(|(wavelength_mm, length_mm)| Specimen {
            wavelength_mm,
            length_mm,
        })
        .to_vec();
    let shaking = Scene {
        motion: Motion::Sinusoid {
            amplitude_mm_s: 100.0,
            frequency_hz: 8.0,
        },
        ..steady.clone()
    };
    let sticky = Scene {
        contact: scene::Contact::stick_slip(Friction::Strong),
        ..steady
    };
    [
        ("signal, % of it: a border", border),
        ("signal, % of it: a shaking hand", shaking),
        ("place, % of λ: strong friction", sticky),
    ]
    .map(|(name, scene)| Case { name, scene })
    .to_vec()
}

/// Who takes part in a case: each rung, and the integrators of what the case lets swing or slip.
pub fn entrants(case: &Case) -> Vec<Entrant> {
    let friction = case.scene.contact.friction;
    let exact = |rung| Entrant {
        rung,
        integrator: None,
        step_us: None,
    };
    let mut entrants: Vec<Entrant> = ContactModel::ALL
        .into_iter()
        // Without friction nothing sticks.
        .filter(|&rung| friction.is_some() || rung != ContactModel::StickSlip)
        .map(exact)
        .collect();
    let rung = match friction {
        Some(_) => ContactModel::StickSlip,
        None => ContactModel::Viscoelastic,
    };
    for integrator in Integrator::ALL {
        let steps: Vec<Option<f64>> = if integrator.is_fixed() {
            STEPS_US.map(Some).to_vec()
        } else {
            vec![None]
        };
        entrants.extend(steps.into_iter().map(|step_us| Entrant {
            rung,
            integrator: Some(integrator),
            step_us,
        }));
    }
    entrants
}

impl Entrant {
    fn contact(self, friction: Option<Friction>) -> scene::Contact {
        scene::Contact {
            rung: self.rung,
            // Below stick-slip nothing knows it; the reference takes what is there.
            friction: friction.filter(|_| self.rung >= ContactModel::StickSlip),
            solver: match self.integrator {
                None => Solver::Exact,
                Some(integrator) => Solver::Stepped {
                    integrator,
                    step_s: self.step_us.map_or(EVENT_STEP_S, |us| us * 1e-6),
                },
            },
        }
    }
}

/// A scan: where the fingertip touches, in mm, and what five gauges feel.
type Felt = (f64, [f32; GAUGES]);

/// A case's surface, as points and patches feel it.
struct Textures {
    point: Surface,
    patch: Patch,
}

impl Case {
    fn textures(&self) -> Textures {
        Textures {
            point: Surface::new(&self.scene.surface, 0.0),
            patch: Patch::new(&self.scene.surface, 0.0),
        }
    }
}

/// What is felt along a case, scan by scan.
fn felt(case: &Case, textures: &Textures, contact: scene::Contact) -> Vec<Felt> {
    fn scans(case: &Case, contact: scene::Contact, texture: &impl Texture) -> Vec<Felt> {
        let mut contact = Contact::new(contact, case.scene.force.stiffness_n_per_m);
        let count = (DURATION_S * f64::from(SCAN_RATE_HZ)) as u32;
        (0..count)
            .map(|scan| {
                let t_s = f64::from(scan) / f64::from(SCAN_RATE_HZ);
                let place_mm = contact
                    .follow(t_s, case.scene.motion.position_mm(t_s))
                    .position_mm;
                (
                    place_mm,
                    std::array::from_fn(|gauge| texture.felt_by(gauge, place_mm)),
                )
            })
            .collect()
    }
    if contact.rung.has_patch() {
        scans(case, contact, &textures.patch)
    } else {
        scans(case, contact, &textures.point)
    }
}

/// Runs every entrant of every case. `done` is told after each of [`runs`].
pub fn measure(done: impl Fn()) -> Vec<Row> {
    let mut rows = Vec::new();
    for case in cases() {
        let friction = case.scene.contact.friction;
        let textures = case.textures();
        let reference = felt(
            &case,
            &textures,
            scene::Contact::of(ContactModel::Reference, friction),
        );
        for entrant in entrants(&case) {
            let contact = entrant.contact(friction);
            let error_percent = error_percent(&case, &felt(&case, &textures, contact), &reference);
            rows.push(Row {
                case: case.name,
                entrant,
                pace: pace(&case, &textures, contact),
                error_percent,
            });
            done();
        }
    }
    rows
}

/// How many entrants [`measure`] runs.
pub fn runs() -> u64 {
    cases().iter().map(|case| entrants(case).len() as u64).sum()
}

fn pace(case: &Case, textures: &Textures, contact: scene::Contact) -> f64 {
    let began = Instant::now();
    let mut fastest = f64::INFINITY;
    while began.elapsed() < MEASURED {
        let started = Instant::now();
        black_box(felt(case, textures, black_box(contact)));
        fastest = fastest.min(started.elapsed().as_secs_f64());
    }
    DURATION_S / fastest
}

fn error_percent(case: &Case, felt: &[Felt], reference: &[Felt]) -> Option<f64> {
    let (mut off, mut all) = (0.0, 0.0);
    for ((place_mm, felt), (due_mm, due)) in felt.iter().zip(reference) {
        if case.scene.contact.friction.is_some() {
            off += (place_mm - due_mm).powi(2);
            all += case.scene.surface.specimens[0].wavelength_mm.powi(2);
        } else {
            for (felt, due) in felt.iter().zip(due) {
                off += f64::from(felt - due).powi(2);
                all += f64::from(*due).powi(2);
            }
        }
    }
    let percent = 100.0 * (off / all).sqrt();
    percent.is_finite().then_some(percent)
}

#[derive(Serialize)]
struct Record {
    case: &'static str,
    rung: &'static str,
    integrator: &'static str,
    step_us: Option<Short>,
    pace: String,
    error_percent: String,
}

impl Study for [Row] {
    const NAME: &'static str = "models";

    fn table(&self) -> Option<Table> {
        let mut table = Table::new(&["case", "rung", "virtual s per s:", "error, %:"]);
        for row in self.iter().filter(|row| row.entrant.integrator.is_none()) {
            table.row([
                row.case.to_owned(),
                row.entrant.rung.name().to_owned(),
                number(row.pace, 0),
                match (row.entrant.rung, row.error_percent) {
                    (ContactModel::Reference, _) => "–".to_owned(),
                    (_, Some(percent)) => format!("{percent:.2e}"),
                    (_, None) => "diverges".to_owned(),
                },
            ]);
        }
        Some(table)
    }

    fn csvs(&self) -> Result<Vec<(&'static str, String)>, csv::Error> {
        let records = self.iter().map(|row| Record {
            case: row.case,
            rung: row.entrant.rung.name(),
            integrator: row.entrant.integrator.map_or("exact", Integrator::name),
            step_us: row.entrant.step_us.map(Short),
            pace: format!("{:.3e}", row.pace),
            error_percent: row
                .error_percent
                .map_or("diverges".to_owned(), |percent| format!("{percent:.3e}")),
        });
        Ok(vec![("", csv_text(records)?)])
    }

    fn picture(&self) -> String {
        picture::draw(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(
        case: usize,
        rung: ContactModel,
        integrator: Option<Integrator>,
        step_us: Option<f64>,
    ) -> f64 {
        let case = &cases()[case];
        let friction = case.scene.contact.friction;
        let entrant = Entrant {
            rung,
            integrator,
            step_us,
        };
        let textures = case.textures();
        let reference = felt(
            case,
            &textures,
            scene::Contact::of(ContactModel::Reference, friction),
        );
        error_percent(
            case,
            &felt(case, &textures, entrant.contact(friction)),
            &reference,
        )
        .unwrap_or(f64::INFINITY)
    }

    #[test]
    fn where_a_rung_knows_all_that_happens_it_is_the_reference() {
        // A hand at a steady speed sets the reference's spring into no motion. But rounding may decide at a
        // scan whether a period's table is asked or the patch summed up: 2e-4 at one of 2000.
        assert!(error(0, ContactModel::Rigid, None, None) < 0.02);
        // f32, and Radau's tolerance.
        assert!(error(1, ContactModel::Viscoelastic, None, None) < 1e-3);
    }

    #[test]
    fn where_it_does_not_it_is_far_off() {
        assert!(error(0, ContactModel::Kinematic, None, None) > 10.0);
        assert!(error(1, ContactModel::Rigid, None, None) > 1.0);
        assert!(error(2, ContactModel::Viscoelastic, None, None) > 30.0);
    }

    #[test]
    fn shorter_steps_come_nearer() {
        for (integrator, order) in [(Integrator::Euler, 1), (Integrator::Implicit, 2)] {
            let at = |step_us| {
                error(
                    1,
                    ContactModel::Viscoelastic,
                    Some(integrator),
                    Some(step_us),
                )
            };
            let ratio = at(50.0) / at(25.0);
            let due = f64::from(1 << order);
            assert!((ratio / due - 1.0).abs() < 0.25, "{integrator:?}: {ratio}");
        }
    }
}
