//! Values shared within this process: a value that is in use is neither made nor held in memory twice.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// Map from keys to values that are held weakly: a value is dropped when its last user drops the [`Arc`].
///
/// ```
/// use sunbeam::cache::Shared;
///
/// static SQUARES: Shared<u64, u64> = Shared::new();
/// let first = SQUARES.get(7, || Ok::<_, ()>(7 * 7)).unwrap();
/// // Still in use: not made again.
/// let second = SQUARES.get(7, || Err(())).unwrap();
/// assert!(std::sync::Arc::ptr_eq(&first, &second));
/// ```
pub struct Shared<K, T> {
    /// Slots by key; `None` until the first call, because `HashMap::new` cannot be called in a constant.
    slots: Mutex<Option<HashMap<K, Slot<T>>>>,
}

/// Value of one key. The mutex is locked while the value is made. The weak reference can no longer be upgraded once the
/// last user has dropped the value.
type Slot<T> = Arc<Mutex<Weak<T>>>;

impl<K: Eq + Hash, T> Default for Shared<K, T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<K: Eq + Hash, T> Shared<K, T> {
    /// An empty map.
    pub const fn new() -> Self {
        Self { slots: Mutex::new(None) }
    }

    /// The value of `key` that is in use, or else a new value from `make`.
    ///
    /// The first of concurrent calls with one key makes the value, and the others wait. If its `make` fails, another of
    /// them calls its own `make`. Calls with other keys do not wait. `make` must not call `get` with the same key,
    /// which would wait forever.
    ///
    /// # Errors
    /// The errors of `make`.
    pub fn get<E>(&self, key: K, make: impl FnOnce() -> Result<T, E>) -> Result<Arc<T>, E> {
        // Poisoned locks are used all the same: a panic of `make` changes neither map nor slot.
        let slot = {
            let mut slots = self.slots.lock().unwrap_or_else(PoisonError::into_inner);
            let slots = slots.get_or_insert_with(HashMap::new);
            // Keeps slots that another call holds, for which `get_mut` is `None`, and slots whose value has a user.
            slots.retain(|_, slot| {
                Arc::get_mut(slot)
                    .is_none_or(|value| value.get_mut().unwrap_or_else(PoisonError::into_inner).strong_count() > 0)
            });
            Arc::clone(slots.entry(key).or_default())
        };
        let mut weak = slot.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(value) = weak.upgrade() {
            return Ok(value);
        }
        let value = Arc::new(make()?);
        *weak = Arc::downgrade(&value);
        Ok(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    #[test]
    fn values_in_use_are_shared_and_others_are_dropped() {
        let shared = Shared::<u32, String>::new();
        let get = |key| shared.get(key, || Ok::<_, Infallible>(format!("made for {key}"))).unwrap();
        let (a, b, c) = (get(1), get(1), get(2));
        assert!(Arc::ptr_eq(&a, &b) && !Arc::ptr_eq(&a, &c));
        assert_eq!(*c, "made for 2");
        let kept = || shared.slots.lock().unwrap().as_ref().map_or(0, HashMap::len);
        assert_eq!(kept(), 2);
        drop((a, b));
        assert_eq!(shared.get(2, || Err("not called")).unwrap().as_str(), "made for 2");
        assert_eq!(kept(), 1);
        assert_eq!(shared.get(1, || Err("called again")), Err("called again"));
        assert_eq!(*get(1), "made for 1");
    }

    #[test]
    fn concurrent_calls_make_one_value() {
        let shared = Shared::<u32, u32>::new();
        let made = Mutex::new(0);
        let make = || {
            std::thread::sleep(std::time::Duration::from_millis(20));
            *made.lock().unwrap() += 1;
            Ok::<_, Infallible>(7)
        };
        let values: Vec<_> = std::thread::scope(|scope| {
            let calls: Vec<_> = (0..4).map(|_| scope.spawn(|| shared.get(0, make).unwrap())).collect();
            calls.into_iter().map(|call| call.join().unwrap()).collect()
        });
        assert_eq!((values.len(), *made.lock().unwrap()), (4, 1));
    }
}
