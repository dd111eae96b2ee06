//! Addresses of catalogs and object stores as text, and passwords in them.

/// Returns whether a text is an address such as `s3://bucket` and not a path.
pub fn is_address(text: &str) -> bool {
    text.contains("://")
}

/// Returns whether an address has a password or a secret key, before the host or among the parameters.
pub fn has_password(address: &str) -> bool {
    let (scheme, rest) = address.split_once("://").unwrap_or(("", address));
    let (user, _) = split_user(scheme, rest);
    user.contains(':') || rest.to_ascii_lowercase().contains("password=")
}

/// Splits the part after the scheme at the last `@` before the parameters. The user is empty if there is none.
fn split_user<'a>(scheme: &str, rest: &'a str) -> (&'a str, &'a str) {
    let place = rest.split(['?', '#']).next().unwrap_or_default();
    // The path in a bucket may contain any sign. A password may contain a slash by mistake.
    let end = match scheme {
        "s3" => place.find('/').unwrap_or(place.len()),
        _ => place.len(),
    };
    match place[..end].rfind('@') {
        Some(at) => (&place[..at], &place[at + 1..]),
        None => ("", place),
    }
}

/// Removes user, password and parameters from an address, for messages. Keeps the user of a database.
pub fn without_password(address: &str) -> String {
    let Some((scheme, rest)) = address.split_once("://") else {
        return if has_password(address) {
            "the address".to_owned()
        } else {
            address.to_owned()
        };
    };
    let (user, place) = split_user(scheme, rest);
    let user = user.split(':').next().unwrap_or_default();
    if scheme.starts_with("postgres") && !user.is_empty() {
        format!("{scheme}://{user}@{place}")
    } else {
        format!("{scheme}://{place}")
    }
}

#[cfg(test)]
mod tests {
    use super::{has_password, without_password};

    #[test]
    fn passwords_are_found_and_not_shown() {
        for address in [
            "postgres://me:secret@db.example/lab",
            "postgres://me:se@cret@db.example/lab?sslmode=disable",
            "postgres://me:se/cret@db.example/lab",
            "postgres://db.example:5432/lab?password=secret",
            "postgres://db.example:5432/lab?sslPassword=secret",
            "postgres://db.example:5432/lab?sslmode=require&password=secret",
            "s3://AKIA:secret@bucket/folder",
            "host=db.example password=secret",
        ] {
            assert!(has_password(address), "{address}");
            assert!(!without_password(address).contains("cret"), "{address}");
        }
    }

    #[test]
    fn addresses_without_a_password_are_kept() {
        for address in [
            "postgres://me@db.example/lab",
            "postgres://db.example:5432/lab",
            "s3://bucket/folder",
            "s3://bucket/2024-01-01T10:00@lab",
            "/mnt/nas/a:b",
        ] {
            assert!(!has_password(address), "{address}");
            assert_eq!(without_password(address), address);
        }
    }
}
