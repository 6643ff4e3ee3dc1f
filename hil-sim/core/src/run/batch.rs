//! The same work on many inputs on several threads, its results handed over in the inputs' order, with only so
//! many of them waiting as there are threads.

use std::collections::BTreeMap;
use std::num::NonZero;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError, mpsc};
use std::thread;

/// Does `work` on each input on so many threads, and hands each result with its input's index to `finished`,
/// on the calling thread and in the inputs' order. No thread is more than two inputs a thread ahead of what has
/// been handed over: memory does not grow with the inputs. After an error of `finished`'s nothing more is begun.
///
/// # Errors
/// The first of `finished`'s.
///
/// # Panics
/// If `work` does.
pub fn in_order<I: Sync, O: Send, E>(
    inputs: &[I],
    threads: NonZero<usize>,
    work: impl Fn(&I) -> O + Sync,
    mut finished: impl FnMut(usize, O) -> Result<(), E>,
) -> Result<(), E> {
    let threads = threads.get().min(inputs.len());
    // One for each input that may be begun.
    let (permit, permits) = mpsc::channel();
    let allow = |permit: &mpsc::Sender<()>| permit.send(()).unwrap_or_default();
    (0..2 * threads).for_each(|_| allow(&permit));
    let (permits, next) = (Mutex::new(permits), AtomicUsize::new(0));
    let (sender, results) = mpsc::channel();
    let is_permitted = || {
        let permits = permits.lock().unwrap_or_else(PoisonError::into_inner);
        permits.recv().is_ok()
    };
    thread::scope(|scope| {
        // Dropped at the end or at an error, whoever waits for one is done.
        let permit = permit;
        for _ in 0..threads {
            let (sender, next, work, is_permitted) = (sender.clone(), &next, &work, &is_permitted);
            scope.spawn(move || {
                while is_permitted() {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(input) = inputs.get(index) else {
                        return;
                    };
                    let result = catch_unwind(AssertUnwindSafe(|| work(input)));
                    // Nobody listens any more after an error.
                    if sender.send((index, result)).is_err() {
                        return;
                    }
                }
            });
        }
        drop(sender);
        let mut waiting = BTreeMap::new();
        let mut due = 0;
        while due < inputs.len() {
            let Ok((index, result)) = results.recv() else {
                break;
            };
            waiting.insert(index, result.unwrap_or_else(|panic| resume_unwind(panic)));
            while let Some(result) = waiting.remove(&due) {
                finished(due, result)?;
                due += 1;
                allow(&permit);
            }
        }
        Ok(())
    })
}

/// What `work` makes of each input, in the inputs' order, on all cores. After an error no further work is begun.
///
/// # Errors
/// The first of `work`'s, by the inputs' order.
///
/// # Panics
/// If `work` does.
pub fn on_all_cores<I: Sync, O: Send, E: Send>(
    inputs: &[I],
    work: impl Fn(&I) -> Result<O, E> + Sync,
) -> Result<Vec<O>, E> {
    let cores = thread::available_parallelism().unwrap_or(NonZero::<usize>::MIN);
    let mut outputs = Vec::with_capacity(inputs.len());
    in_order(inputs, cores, work, |_, result| {
        outputs.push(result?);
        Ok(())
    })?;
    Ok(outputs)
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    fn threads(count: usize) -> NonZero<usize> {
        NonZero::new(count).unwrap()
    }

    #[test]
    fn results_come_in_the_inputs_order_whichever_is_done_first() {
        // Even inputs take longer.
        let work = |n: &u64| {
            let turns = if n.is_multiple_of(2) { 20_000 } else { 10 };
            (0..turns).fold(*n, |n, _| n.wrapping_mul(6_364_136_223_846_793_005))
        };
        let inputs: Vec<u64> = (0..100).collect();
        for count in [1, 2, 7, usize::MAX] {
            let mut seen = Vec::new();
            let all: Result<(), ()> = in_order(&inputs, threads(count), work, |index, result| {
                assert_eq!(result, work(&inputs[index]));
                seen.push(index);
                Ok(())
            });
            assert_eq!(all, Ok(()));
            assert_eq!(seen, (0..100).collect::<Vec<_>>());
        }
        let none: Result<(), ()> = in_order(&[], threads(2), work, |_, _| Err(()));
        assert_eq!(none, Ok(()));
    }

    #[test]
    fn no_more_wait_than_there_is_room_for() {
        let (begun, handed) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let work = |_: &usize| {
            let begun = begun.fetch_add(1, Ordering::SeqCst) + 1;
            assert!(begun <= handed.load(Ordering::SeqCst) + 2 * 3 + 1);
        };
        let inputs: Vec<usize> = (0..500).collect();
        let all: Result<(), ()> = in_order(&inputs, threads(3), work, |_, ()| {
            handed.fetch_add(1, Ordering::SeqCst);
            Ok(())
        });
        assert_eq!((all, begun.into_inner()), (Ok(()), 500));
    }

    #[test]
    fn on_all_cores_gives_all_outputs_or_the_first_error() {
        let inputs: Vec<u32> = (0..50).collect();
        let doubled: Result<Vec<u32>, ()> = on_all_cores(&inputs, |n| Ok(2 * n));
        assert_eq!(doubled, Ok((0..50).map(|n| 2 * n).collect()));
        let refused = on_all_cores(&inputs, |n| if *n == 20 { Err(*n) } else { Ok(*n) });
        assert_eq!(refused, Err(20));
    }

    #[test]
    fn an_error_ends_it_and_so_does_a_panic() {
        let begun = AtomicUsize::new(0);
        let work = |_: &usize| begun.fetch_add(1, Ordering::SeqCst);
        let inputs: Vec<usize> = (0..500).collect();
        let refused = in_order(&inputs, threads(2), work, |index, _| {
            if index == 20 { Err(index) } else { Ok(()) }
        });
        assert_eq!(refused, Err(20));
        assert!(begun.into_inner() <= 25);
        let panics = catch_unwind(|| {
            let work = |n: &usize| assert_ne!(*n, 20, "meant");
            let _: Result<(), ()> = in_order(&inputs, threads(2), work, |_, ()| Ok(()));
        });
        assert!(panics.is_err());
    }
}
