//! Reproducible random numbers.

use super::ContentHash;

/// A source of random numbers. A number depends only on seed, name, subject and purpose, not on earlier draws.
///
/// ```
/// use mocban_core::domain::{ContentHash, SeededRandom};
///
/// let random = SeededRandom::new(7, "lan");
/// let subject = ContentHash::of(b"a result");
/// let number = random.draw(&subject, "order");
/// assert!((0.0..1.0).contains(&number));
/// assert_eq!(number, SeededRandom::new(7, "lan").draw(&subject, "order"));
/// assert_ne!(number, random.draw(&subject, "another purpose"));
/// ```
#[derive(Debug, Clone)]
pub struct SeededRandom {
    seed: u64,
    name: String,
}

impl SeededRandom {
    /// Returns the source for a seed and a name, such as the name of a reviewer.
    pub fn new(seed: u64, name: &str) -> Self {
        Self {
            seed,
            name: name.to_owned(),
        }
    }

    /// Returns a number in 0..1, uniformly distributed.
    pub fn draw(&self, subject: &ContentHash, purpose: &str) -> f64 {
        let mut bytes = self.seed.to_le_bytes().to_vec();
        for part in [self.name.as_bytes(), subject.as_bytes(), purpose.as_bytes()] {
            bytes.extend((part.len() as u64).to_le_bytes());
            bytes.extend(part);
        }
        let hash = ContentHash::of(&bytes);
        let mut head = [0; 8];
        head.copy_from_slice(&hash.as_bytes()[..8]);
        // An f64 has a 53-bit significand.
        (u64::from_le_bytes(head) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::SeededRandom;
    use crate::domain::ContentHash;

    #[test]
    fn numbers_are_uniform() {
        let random = SeededRandom::new(7, "ana");
        let low = (0..2000_u32).filter(|i| {
            let subject = ContentHash::of(&i.to_le_bytes());
            random.draw(&subject, "control") < 0.25
        });
        let low = low.count();
        assert!((430..570).contains(&low), "{low}");
    }
}
