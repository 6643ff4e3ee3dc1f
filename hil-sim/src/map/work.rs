//! Runs scenes on several threads.

use std::num::NonZero;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;

use super::measurement::Measurement;
use crate::scene::{Scene, SceneError};

/// Runs every scene and hands each measurement (or why there is none), with the scene's number, to `finished` on the calling
/// thread, in the order they finish. After an error no further scene is begun.
///
/// # Errors
/// The first of `finished`'s.
pub fn measure<E>(
    scenes: &[Scene],
    threads: NonZero<usize>,
    mut finished: impl FnMut(usize, Result<Measurement, SceneError>) -> Result<(), E>,
) -> Result<(), E> {
    let next = AtomicUsize::new(0);
    let (sender, receiver) = mpsc::channel();
    thread::scope(|scope| {
        for _ in 0..threads.get().min(scenes.len()) {
            let (sender, next) = (sender.clone(), &next);
            scope.spawn(move || {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(scene) = scenes.get(index) else {
                        return;
                    };
                    // Nobody listens any more after an error.
                    if sender.send((index, Measurement::of(scene))).is_err() {
                        return;
                    }
                }
            });
        }
        drop(sender);
        for (index, measurement) in receiver {
            finished(index, measurement)?;
        }
        Ok(())
    })
}
