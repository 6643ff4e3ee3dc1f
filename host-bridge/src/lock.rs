//! Mutexes whose data are sound at every moment.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Locks `mutex`, whoever died holding it.
pub fn locked<T: ?Sized>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
