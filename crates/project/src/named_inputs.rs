//! The names of copies of inputs, which stay the same in all backups to one file.

use std::collections::HashMap;

use crate::input_list::{CopiedInput, INPUT_LIST};
use crate::input_names::InputNames;
use crate::wanted_inputs::WantedInput;

/// An input with the name of its copy.
#[derive(Debug)]
pub(crate) struct NamedInput {
    pub(crate) wanted: WantedInput,
    /// Path of the copy below the folder, with slashes.
    pub(crate) name: String,
}

/// Names the copies of inputs: each as in an earlier list, or with a name that is not in it.
pub(crate) fn named_inputs(wanted: Vec<WantedInput>, earlier: &[CopiedInput]) -> Vec<NamedInput> {
    let mut names = InputNames::without(INPUT_LIST);
    let mut known: HashMap<&str, &str> = HashMap::with_capacity(earlier.len());
    for copy in earlier {
        names.reserve(&copy.stored, &copy.name);
        known.insert(&copy.stored, &copy.name);
    }
    let named = wanted.into_iter().map(|wanted| {
        let name = match known.get(wanted.stored.as_str()) {
            Some(name) => (*name).to_owned(),
            None => names.next(&wanted.stored),
        };
        NamedInput { wanted, name }
    });
    named.collect()
}

#[cfg(test)]
mod tests {
    use super::named_inputs;
    use crate::input_list::CopiedInput;
    use crate::wanted_inputs::WantedInput;
    use mocban_core::domain::ContentHash;

    #[test]
    fn copies_keep_the_names_of_the_earlier_list() {
        let names = |stored: &[&str], earlier: &[CopiedInput]| -> Vec<String> {
            let wanted = stored.iter().map(|stored| WantedInput::unread(stored));
            let named = named_inputs(wanted.collect(), earlier).into_iter();
            named.map(|input| input.name).collect()
        };
        let (stored, expected) = (["A/1.stl", "a/1.stl"], ["A/1.stl", "a (2)/1.stl"]);
        assert_eq!(names(&stored, &[]), expected);
        let earlier = stored
            .iter()
            .zip(expected)
            .map(|(stored, name)| CopiedInput {
                stored: (*stored).to_owned(),
                name: name.to_owned(),
                bytes: 1,
                hash: ContentHash::of(b"1"),
            });
        let earlier: Vec<CopiedInput> = earlier.collect();
        // The first input is no longer there, and a new one comes before the others.
        assert_eq!(
            names(&["a/2.stl", "/a/1.stl", "a/1.stl"], &earlier),
            ["a (2)/2.stl", "a (2)/1 (2).stl", "a (2)/1.stl"]
        );
    }
}
