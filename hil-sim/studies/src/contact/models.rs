//! Speed against accuracy of the contact models: every rung of [`hil_sim_core::plant::contact`]'s ladder, and every
//! integrator of the rungs that are integrated, in steps of many lengths.
//!
//! Speed is of contact and gauges alone, without boards, in virtual seconds per second of one core. The
//! error is that of the five gauges' signals without noise: RMS of the difference to the reference's, as a
//! share of the reference's own RMS. Where the fingertip sticks and slips it is that of its place, as a
//! share of λ: a slip that comes a little early changes the signal by as much as there is of it.

mod picture;

use std::hint::black_box;
use std::time::{Duration, Instant};

use protocol::GAUGES;

use crate::study::{Progress, Record, Study, Table, csv, number, short};
use hil_sim_core::plant::contact::{Contact, EVENT_STEP_S};
use hil_sim_core::plant::gauges::{SCAN_RATE_HZ, Texture};
use hil_sim_core::plant::patch::Patch;
use hil_sim_core::plant::surface::Surface;
use hil_sim_core::scene::{
    self, ContactModel, Friction, Integrator, Motion, Scene, Solver, Specimen,
};

/// Steps of the integrators that take what they are told.
const STEPS_US: [f64; 8] = [250.0, 125.0, 50.0, 25.0, 10.0, 5.0, 2.0, 1.0];
/// Virtual time of a run: ten slips and more.
const DURATION_S: f64 = 0.5;
/// A run is repeated for so long at least, and the fastest one counts: others have the machine, too.
const MEASURED: Duration = Duration::from_millis(60);

#[derive(Clone, Debug)]
struct Case {
    name: &'static str,
    scene: Scene,
}

/// A rung, solved in one way.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Entrant {
    rung: ContactModel,
    /// None if it is solved exactly, or from event to event.
    integrator: Option<Integrator>,
    /// None if it chooses its own, or has none.
    step_us: Option<f64>,
}

/// What an entrant came to in a case.
#[derive(Clone, Debug)]
pub struct Row {
    case: &'static str,
    entrant: Entrant,
    /// Virtual seconds per second.
    pace: f64,
    /// RMS; none if it diverged.
    error_percent: Option<f64>,
}

fn cases() -> [Case; 3] {
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
}

/// Who takes part in a case: each rung, and the integrators of what the case lets swing or slip.
fn entrants(case: &Case) -> Vec<Entrant> {
    let friction = case.scene.contact.friction;
    let entrant = |rung, integrator, step_us| Entrant {
        rung,
        integrator,
        step_us,
    };
    // Without friction nothing sticks.
    let takes_part = |rung: &_| friction.is_some() || *rung != ContactModel::StickSlip;
    let rungs = ContactModel::ALL.into_iter().filter(takes_part);
    let mut entrants: Vec<Entrant> = rungs.map(|rung| entrant(rung, None, None)).collect();
    let rung = match friction {
        Some(_) => ContactModel::StickSlip,
        None => ContactModel::Viscoelastic,
    };
    for integrator in Integrator::ALL {
        let stepped = |step_us| entrant(rung, Some(integrator), step_us);
        if integrator.is_fixed() {
            entrants.extend(STEPS_US.map(Some).map(stepped));
        } else {
            entrants.push(stepped(None));
        }
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

fn felt(case: &Case, textures: &Textures, contact: scene::Contact) -> Vec<Felt> {
    fn scans(case: &Case, contact: scene::Contact, texture: &impl Texture) -> Vec<Felt> {
        let Scene { force, motion, .. } = &case.scene;
        let mut contact = Contact::new(contact, force.stiffness_n_per_m);
        let count = (DURATION_S * f64::from(SCAN_RATE_HZ)) as u32;
        let instants_s = (0..count).map(|scan| f64::from(scan) / f64::from(SCAN_RATE_HZ));
        let scan = |t_s| {
            let place_mm = contact.follow(t_s, motion.position_mm(t_s)).position_mm;
            let felt = std::array::from_fn(|gauge| texture.felt_by(gauge, place_mm));
            (place_mm, felt)
        };
        instants_s.map(scan).collect()
    }
    if contact.rung.has_patch() {
        scans(case, contact, &textures.patch)
    } else {
        scans(case, contact, &textures.point)
    }
}

/// Runs every entrant of every case, one after the other: they are timed.
pub fn measure(progress: &impl Progress) -> Vec<Row> {
    progress.begin(cases().iter().map(|case| entrants(case).len()).sum());
    let mut rows = Vec::new();
    for case in cases() {
        let friction = case.scene.contact.friction;
        let textures = case.textures();
        let reference = scene::Contact::of(ContactModel::Reference, friction);
        let reference = felt(&case, &textures, reference);
        for entrant in entrants(&case) {
            let contact = entrant.contact(friction);
            let error_percent = error_percent(&case, &felt(&case, &textures, contact), &reference);
            rows.push(Row {
                case: case.name,
                entrant,
                pace: pace(&case, &textures, contact),
                error_percent,
            });
            progress.step();
        }
    }
    rows
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

impl Study for Vec<Row> {
    const NAME: &'static str = "models";

    fn table(&self) -> Option<Table> {
        let exact = self.iter().filter(|row| row.entrant.integrator.is_none());
        let rows = exact.map(|row| {
            let error = match (row.entrant.rung, row.error_percent) {
                (ContactModel::Reference, _) => "–".to_owned(),
                (_, Some(percent)) => format!("{percent:.2e}"),
                (_, None) => "diverges".to_owned(),
            };
            Record::default()
                .with("case", row.case)
                .with("rung", row.entrant.rung.name())
                .with("virtual s per s:", number(row.pace, 0))
                .with("error, %:", error)
        });
        Some(rows.collect())
    }

    fn csvs(&self) -> Vec<(&'static str, String)> {
        let rows = self.iter().map(|row| {
            let entrant = row.entrant;
            let error = row.error_percent.map(|percent| format!("{percent:.3e}"));
            Record::default()
                .with("case", row.case)
                .with("rung", entrant.rung.name())
                .with(
                    "integrator",
                    entrant.integrator.map_or("exact", Integrator::name),
                )
                .with("step_us", entrant.step_us.map(short))
                .with("pace", format!("{:.3e}", row.pace))
                .with("error_percent", error.unwrap_or("diverges".to_owned()))
        });
        vec![("", csv(rows))]
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
