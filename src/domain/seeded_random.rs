//! Chance that comes out the same every time.

use super::ContentHash;

/// A lot drawn for a thing: the same for the same seed, person, thing and purpose.
#[derive(Debug, Clone)]
pub struct SeededRandom {
    seed: u64,
    who: String,
}

impl SeededRandom {
    /// Random numbers of a seed for a reviewer, or for whoever draws.
    pub fn new(seed: u64, who: &str) -> Self {
        Self {
            seed,
            who: who.to_owned(),
        }
    }

    /// A number from 0 up to 1, evenly.
    pub fn draw(&self, thing: &ContentHash, purpose: &str) -> f64 {
        let mut bytes = self.seed.to_le_bytes().to_vec();
        for part in [self.who.as_bytes(), thing.as_bytes(), purpose.as_bytes()] {
            bytes.extend((part.len() as u64).to_le_bytes());
            bytes.extend(part);
        }
        let hash = ContentHash::of(&bytes);
        let mut head = [0; 8];
        head.copy_from_slice(&hash.as_bytes()[..8]);
        // 53 bits fill the fraction of an f64.
        (u64::from_le_bytes(head) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::SeededRandom;
    use crate::domain::ContentHash;

    #[test]
    fn lots_fall_evenly() {
        let lots = SeededRandom::new(7, "ana");
        let low = (0..2000_u32).filter(|i| {
            let thing = ContentHash::of(&i.to_le_bytes());
            lots.draw(&thing, "control") < 0.25
        });
        let low = low.count();
        assert!((430..570).contains(&low), "{low}");
    }
}
