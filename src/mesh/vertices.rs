//! Where the corners of a surface lie.

use crate::page_vec::PageVec;

/// Positions in the mesh's own frame and unit, all finite, each kept as precisely as its file says it and no more: what
/// lies in memory is what most of the time goes into.
#[derive(Debug, Clone)]
pub enum Vertices {
    /// Of files that hold 32-bit floats, as scanners' do.
    Single(PageVec<[f32; 3]>),
    /// Of text and of 64-bit floats.
    Double(PageVec<[f64; 3]>),
}

impl Vertices {
    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Self::Single(all) => all.len(),
            Self::Double(all) => all.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// How many there is room for.
    pub fn capacity(&self) -> usize {
        match self {
            Self::Single(all) => all.capacity(),
            Self::Double(all) => all.capacity(),
        }
    }

    /// One of them; panics past the last.
    #[inline]
    pub fn at(&self, place: usize) -> [f64; 3] {
        match self {
            Self::Single(all) => all[place].map(f64::from),
            Self::Double(all) => all[place],
        }
    }

    /// All in their order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = [f64; 3]> + Clone {
        (0..self.len()).map(|place| self.at(place))
    }

    /// Adds one at the end.
    pub fn push(&mut self, vertex: [f64; 3]) {
        self.double().push(vertex);
    }

    /// Puts another in the place of one; panics past the last.
    pub fn set(&mut self, place: usize, vertex: [f64; 3]) {
        self.double()[place] = vertex;
    }

    /// Puts another in the place of each.
    pub fn change(&mut self, other: impl Fn([f64; 3]) -> [f64; 3]) {
        for vertex in self.double() {
            *vertex = other(*vertex);
        }
    }

    /// In double precision, so that any can be written.
    fn double(&mut self) -> &mut PageVec<[f64; 3]> {
        if let Self::Single(_) = self {
            *self = self.iter().collect();
        }
        match self {
            Self::Double(all) => all,
            Self::Single(_) => unreachable!("made double above"),
        }
    }
}

impl Default for Vertices {
    fn default() -> Self {
        Self::Double(PageVec::default())
    }
}

/// Equal where they lie at the same places.
impl PartialEq for Vertices {
    fn eq(&self, other: &Self) -> bool {
        self.iter().eq(other.iter())
    }
}

impl From<Vec<[f64; 3]>> for Vertices {
    fn from(all: Vec<[f64; 3]>) -> Self {
        Self::Double(all.into())
    }
}

impl FromIterator<[f64; 3]> for Vertices {
    fn from_iter<I: IntoIterator<Item = [f64; 3]>>(all: I) -> Self {
        Self::Double(all.into_iter().collect())
    }
}

impl Extend<[f64; 3]> for Vertices {
    fn extend<I: IntoIterator<Item = [f64; 3]>>(&mut self, more: I) {
        self.double().extend(more);
    }
}

#[cfg(test)]
mod tests {
    use super::Vertices;

    #[test]
    fn both_precisions_say_the_same_and_neither_loses_anything() {
        let single = Vertices::Single(vec![[0.1_f32, 2.0, -3.5], [4.0, 5.0, 6.25]].into());
        let mut double: Vertices = single.iter().collect();
        assert_eq!(single, double);
        assert_eq!(single.at(0)[0], f64::from(0.1_f32));
        let mut more = single.clone();
        for vertices in [&mut more, &mut double] {
            vertices.push([0.1, 0.2, 0.3]);
            vertices.change(|[x, y, z]| [z, x, y]);
            vertices.extend([[7.0; 3]]);
            vertices.set(1, [0.7; 3]);
        }
        assert_eq!(more, double);
        assert_eq!(more.at(2), [0.3, 0.1, 0.2]);
        assert_ne!(single, more);
        assert_eq!((single.len(), more.len()), (2, 4));
    }
}
