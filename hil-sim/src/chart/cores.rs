//! The same work on many inputs, on all cores.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// What `work` makes of each input, in the inputs' order. After an error no further work is begun.
///
/// # Errors
/// The first of `work`'s, by the inputs' order.
pub(crate) fn on_all_cores<I: Sync, O: Send, E: Send>(
    inputs: &[I],
    work: impl Fn(&I) -> Result<O, E> + Sync,
) -> Result<Vec<O>, E> {
    let cores = thread::available_parallelism().map_or(1, usize::from);
    let next = AtomicUsize::new(0);
    let done: Vec<Mutex<Option<Result<O, E>>>> = inputs.iter().map(|_| Mutex::new(None)).collect();
    thread::scope(|scope| {
        for _ in 0..cores.min(inputs.len()) {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let (Some(input), Some(place)) = (inputs.get(index), done.get(index)) else {
                        return;
                    };
                    let result = work(input);
                    if result.is_err() {
                        next.store(inputs.len(), Ordering::Relaxed);
                    }
                    *place
                        .lock()
                        .unwrap_or_else(|poisoned| poisoned.into_inner()) = Some(result);
                }
            });
        }
    });
    // What comes after an error may not have been begun.
    done.into_iter()
        .filter_map(|place| {
            place
                .into_inner()
                .unwrap_or_else(|poisoned| poisoned.into_inner())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outputs_come_in_the_inputs_order_and_an_error_ends_it() {
        let inputs: Vec<u32> = (0..50).collect();
        let doubled: Result<Vec<u32>, ()> = on_all_cores(&inputs, |n| Ok(2 * n));
        assert_eq!(doubled, Ok((0..50).map(|n| 2 * n).collect()));
        let refused = on_all_cores(&inputs, |n| if *n == 20 { Err(*n) } else { Ok(*n) });
        assert_eq!(refused, Err(20));
    }
}
