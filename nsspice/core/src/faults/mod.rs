//! Faults that can be built into the engines, to see whether the certificate sees them.
//!
//! They are compiled with the feature `faults` alone, which no package has; one of them is chosen at run time.
//! `fault!("name", sound, damaged)` is `sound` unless the fault of that name is chosen, and `fault!("name" =>
//! statement)` nothing.

#[cfg(feature = "faults")]
macro_rules! fault {
    ($name:literal, $sound:expr, $damaged:expr) => {{
        const NUMBER: usize = $crate::faults::number($name);
        if $crate::faults::is_chosen(NUMBER) {
            $damaged
        } else {
            $sound
        }
    }};
    ($name:literal => $damage:expr) => {{
        const NUMBER: usize = $crate::faults::number($name);
        if $crate::faults::is_chosen(NUMBER) {
            $damage;
        }
    }};
}

#[cfg(not(feature = "faults"))]
macro_rules! fault {
    ($name:literal, $sound:expr, $damaged:expr) => {
        $sound
    };
    ($name:literal => $damage:expr) => {};
}

#[cfg(feature = "faults")]
pub mod damage;
#[cfg(feature = "faults")]
mod list;

#[cfg(feature = "faults")]
pub use list::FAULTS;

#[cfg(feature = "faults")]
mod chosen {
    use super::FAULTS;
    use std::sync::atomic::{AtomicUsize, Ordering};

    const NONE: usize = usize::MAX;
    static CHOSEN: AtomicUsize = AtomicUsize::new(NONE);

    /// Lets the engines make one fault from here on, or none.
    pub fn choose(name: Option<&str>) -> bool {
        let number = name.map(|name| FAULTS.iter().position(|fault| fault.0 == name));
        CHOSEN.store(number.unwrap_or(Some(NONE)).unwrap_or(NONE), Ordering::Relaxed);
        number != Some(None)
    }

    /// Whether a fault is the one that was chosen.
    #[inline]
    pub fn is_chosen(number: usize) -> bool {
        CHOSEN.load(Ordering::Relaxed) == number
    }

    /// The number of a fault; does not compile for a name that is not in the list.
    pub const fn number(name: &str) -> usize {
        let mut k = 0;
        while k < FAULTS.len() {
            if same(FAULTS[k].0.as_bytes(), name.as_bytes()) {
                return k;
            }
            k += 1;
        }
        panic!("no fault has that name")
    }

    const fn same(a: &[u8], b: &[u8]) -> bool {
        if a.len() != b.len() {
            return false;
        }
        let mut k = 0;
        while k < a.len() {
            if a[k] != b[k] {
                return false;
            }
            k += 1;
        }
        true
    }
}

#[cfg(feature = "faults")]
pub use chosen::{choose, is_chosen, number};
