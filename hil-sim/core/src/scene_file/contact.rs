//! `[contact]`, and what `"auto"` makes of it.

use super::table::Table;
use crate::plant::contact::{EVENT_STEP_S, Stribeck, select, stability};
use crate::scene::{
    Contact, ContactModel, Friction, Gauges, Integrator, Motion, SceneError, Solver, Surface,
};

/// Longest step of a method that is not told one, in s.
const DEFAULT_STEP_S: f64 = 50e-6;
/// Share of the longest step that it bears which a method takes then.
const DEFAULT_SHARE: f64 = 0.5;

/// What the contact depends on.
pub(super) struct Scenery<'a> {
    pub surface: &'a Surface,
    pub motion: &'a Motion,
    pub gauges: &'a Gauges,
    pub stiffness_n_per_m: f64,
}

/// Whether a contact is asked for: by another word than those that stand for none.
pub(super) fn is_given(mut table: Table<'_>) -> Result<bool, SceneError> {
    let model = table.variant::<ContactModel>("model", "auto")?;
    let friction = table.variant::<Friction>("friction", "none")?;
    let integrator = table.variant::<Integrator>("integrator", "exact")?;
    let has_step = table.number("step_us")?.is_some();
    table.finish("")?;
    Ok(model.is_some() || friction.is_some() || integrator.is_some() || has_step)
}

/// The contact, and why if it was left open. Of recorded gauges there is none.
pub(super) fn read(
    mut table: Table<'_>,
    scenery: &Scenery<'_>,
) -> Result<(Contact, Option<String>), SceneError> {
    let model = table.variant::<ContactModel>("model", "auto")?;
    let friction = table.variant::<Friction>("friction", "none")?;
    match (model, friction) {
        (
            Some(
                rung @ (ContactModel::Kinematic | ContactModel::Rigid | ContactModel::Viscoelastic),
            ),
            Some(_),
        ) => {
            return Err(table.refuse(
                "friction",
                format!(
                    "a \"{}\" contact knows no friction: give \"none\", or model = \"stick-slip\"",
                    rung.name()
                ),
            ));
        }
        (Some(ContactModel::StickSlip), None) => {
            return Err(table.refuse(
                "friction",
                "without friction nothing sticks: give \"mild\", \"strong\" or \"severe\", or model = \"kinematic\"",
            ));
        }
        _ => {}
    }
    let (rung, reason) = match model {
        Some(rung) => (rung, None),
        None => {
            let choice = select::choose(
                scenery.surface,
                scenery.motion,
                scenery.gauges,
                friction,
                scenery.stiffness_n_per_m,
            );
            (choice.rung, Some(choice.reason))
        }
    };
    let solver = solver(&mut table, rung, friction, scenery)?;
    table.finish("")?;
    let contact = Contact {
        rung,
        friction,
        solver,
    };
    Ok((contact, reason))
}

fn solver(
    table: &mut Table<'_>,
    rung: ContactModel,
    friction: Option<Friction>,
    scenery: &Scenery<'_>,
) -> Result<Solver, SceneError> {
    let integrator = table.variant::<Integrator>("integrator", "exact")?;
    let step_us = table.number("step_us")?;
    let Some(integrator) = integrator else {
        return match step_us {
            None => Ok(Solver::Exact),
            Some(_) => Err(table.refuse(
                "step_us",
                "an \"exact\" solution has no steps: take it out, or give an integrator",
            )),
        };
    };
    if !matches!(rung, ContactModel::Viscoelastic | ContactModel::StickSlip) {
        return Err(table.refuse(
            "integrator",
            match rung {
                ContactModel::Reference => "the reference has its own: take it out, or give another model",
                _ => "there is nothing to integrate: take it out, or give model = \"viscoelastic\" or \"stick-slip\"",
            },
        ));
    }
    if !integrator.is_fixed() {
        return match step_us {
            None => Ok(Solver::Stepped {
                integrator,
                step_s: EVENT_STEP_S,
            }),
            Some(_) => Err(table.refuse(
                "step_us",
                format!(
                    "\"{}\" chooses its own steps: take it out",
                    integrator.name()
                ),
            )),
        };
    }
    let stiffness_n_per_m = scenery.stiffness_n_per_m;
    let longest_s = match friction {
        None => stability::longest_swinging_s(integrator, stiffness_n_per_m),
        Some(friction) => stability::longest_slipping_s(
            integrator,
            Stribeck::new(friction),
            stiffness_n_per_m,
            scenery.motion.top_speed_mm_s() * 1e-3,
        ),
    };
    let step_s = match step_us {
        None => DEFAULT_STEP_S.min(DEFAULT_SHARE * longest_s),
        Some(step_us) if step_us * 1e-6 <= longest_s => step_us * 1e-6,
        Some(step_us) => {
            return Err(table.refuse(
                "step_us",
                format!(
                    "in steps of {step_us} µs errors grow with \"{}\", a stiffness of {stiffness_n_per_m} N/m and this hand; it bears {}: give less, take step_us out, or give integrator = \"implicit\"",
                    integrator.name(),
                    microseconds(longest_s),
                ),
            ));
        }
    };
    Ok(Solver::Stepped { integrator, step_s })
}

/// A step in µs, rounded down to three digits: what is said to be borne is.
fn microseconds(step_s: f64) -> String {
    let us = step_s * 1e6;
    let scale = 10f64.powi(2 - us.log10().floor() as i32);
    format!("{} µs", (us * scale).floor() / scale)
}
