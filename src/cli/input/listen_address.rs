//! The address at which other computers reach a page.

use std::net::IpAddr;

/// Parses an address. 0.0.0.0 and :: are refused, because they stand for all addresses of a computer, and a page accepts
/// only requests for one.
pub(crate) fn listen_address(text: &str) -> Result<IpAddr, String> {
    match text.parse::<IpAddr>() {
        Ok(address) if address.to_canonical().is_unspecified() || address.is_multicast() => {
            Err("name the one address of this computer at which others open the page".to_owned())
        }
        Ok(IpAddr::V6(address)) if address.is_unicast_link_local() => Err(
            "browsers cannot open an address that begins with fe80: name another one of this computer".to_owned(),
        ),
        Ok(address) => Ok(address),
        Err(_) => Err("an address is written like 192.168.1.20".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::listen_address;

    #[test]
    fn one_address_is_accepted() {
        assert!(listen_address("192.168.1.20").is_ok() && listen_address("fd00::7").is_ok());
        for text in [
            "0.0.0.0",
            "::",
            "::ffff:0.0.0.0",
            "224.0.0.1",
            "fe80::1",
            "computer",
            "192.168.1.20:80",
        ] {
            assert!(listen_address(text).is_err(), "{text}");
        }
    }
}
