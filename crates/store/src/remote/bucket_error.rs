//! Why a request to an object store failed. Messages never contain a reply of the store, which may name access keys.

use std::error::Error;
use std::io;

use mocban_core::domain::NOT_THERE;

/// Why a request to an object store failed.
#[derive(Debug, thiserror::Error)]
pub enum BucketError {
    /// There is no such object.
    #[error("{0}{end}", end = NOT_THERE)]
    NotThere(String),
    /// There is no such bucket.
    #[error("{0}: there is no such bucket; create it, or correct the setting that names it")]
    NoBucket(String),
    /// The store refuses the credentials, or they do not permit the request.
    #[error(
        "{address}: the object store refuses the request ({code}); check AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and AWS_SESSION_TOKEN, and that they permit it"
    )]
    Refused {
        /// Which object or folder.
        address: String,
        /// The store's error code, such as `ExpiredToken`.
        code: String,
    },
    /// The store could not be reached, or had no success within the time limit.
    #[error(
        "{address}: the object store does not answer properly ({reason}); check that it runs, and AWS_ENDPOINT_URL"
    )]
    Unavailable {
        /// Which object or folder.
        address: String,
        /// What was tried, without the reply of the store.
        reason: String,
    },
    /// The server has no certificate for its address that this computer accepts.
    #[error(
        "{address}: the certificate of the object store is not accepted ({reason}); check the host name in AWS_ENDPOINT_URL, the clock of this computer, and that it knows the authority (a file named by SSL_CERT_FILE)"
    )]
    Certificate {
        /// Which object or folder.
        address: String,
        /// Why it is not accepted.
        reason: String,
    },
    /// The store refuses the request for another reason, which will be the same next time.
    #[error("{address}: the object store refuses the request ({reason})")]
    Failed {
        /// Which object or folder.
        address: String,
        /// The store's error code, such as `EntityTooLarge`, or the HTTP status.
        reason: String,
    },
    /// The store refuses the request for a reason that lies in this object, such as its long name.
    #[error(
        "{address}: the object store refuses this object ({code}{})",
        object_advice(code)
    )]
    Object {
        /// Which object.
        address: String,
        /// The store's error code.
        code: String,
    },
    /// The address is not that of a folder in a bucket, or the environment lacks something.
    #[error("{address}: {reason}")]
    Address {
        /// The address.
        address: String,
        /// What is wrong with it.
        reason: String,
    },
    /// The object is larger than the limit.
    #[error("{address} has {bytes} bytes, over the limit of {limit}")]
    TooLarge {
        /// Which object.
        address: String,
        /// Its length.
        bytes: u64,
        /// The limit in bytes.
        limit: u64,
    },
    /// The local copy of the object could not be written.
    #[error("{path}: {source}")]
    Local {
        /// Which file.
        path: std::path::PathBuf,
        /// Why.
        source: io::Error,
    },
}

/// Code of the reply for an object in an archive, such as Glacier.
const ARCHIVED: &str = "InvalidObjectState";

/// Returns what to do about an object that is refused, or an empty text.
fn object_advice(code: &str) -> &'static str {
    match code {
        ARCHIVED => "; it is archived: restore it first",
        _ => "",
    }
}

impl BucketError {
    /// Converts an error of the client.
    pub(super) fn of(address: &str, error: &object_store::Error) -> Self {
        let address = address.to_owned();
        let code = code_of(error);
        match (error, code.as_deref()) {
            (_, Some("NoSuchBucket")) => Self::NoBucket(address),
            (_, Some(code @ (ARCHIVED | "KeyTooLongError"))) => Self::Object {
                address,
                code: code.to_owned(),
            },
            (_, Some(code @ "QuotaExceeded")) => Self::of_reply(address, error, Some(code)),
            (object_store::Error::NotFound { .. }, _) => Self::NotThere(address),
            (_, Some(code)) if is_refusal(code) => Self::Refused {
                address,
                code: code.to_owned(),
            },
            (
                object_store::Error::PermissionDenied { .. }
                | object_store::Error::Unauthenticated { .. },
                code,
            ) => Self::Refused {
                address,
                code: code.unwrap_or("permission denied").to_owned(),
            },
            (error, code) => Self::of_reply(address, error, code),
        }
    }

    /// Converts an error that is not about access.
    fn of_reply(address: String, error: &object_store::Error, code: Option<&str>) -> Self {
        let status = status_of(error);
        if is_redirect(error, status) {
            let reason = "it redirects to another place; check AWS_REGION and AWS_ENDPOINT_URL";
            let reason = reason.to_owned();
            return Self::Failed { address, reason };
        }
        if let Some(reason) = certificate_fault(error) {
            return Self::Certificate { address, reason };
        }
        let status_text = status.map(|status| format!("HTTP status {status}"));
        let reason = code.map(str::to_owned).or(status_text);
        match reason {
            Some(reason) if !is_temporary(code, status) => Self::Failed { address, reason },
            reason => Self::Unavailable {
                address,
                reason: reason.unwrap_or_else(|| innermost(error)),
            },
        }
    }
}

/// Returns whether the store sends the client to another region or address.
fn is_redirect(error: &object_store::Error, status: Option<u16>) -> bool {
    matches!(status, Some(301 | 308)) || error.to_string().contains("redirect without LOCATION")
}

/// Returns whether the reply to the same request may differ later.
fn is_temporary(code: Option<&str>, status: Option<u16>) -> bool {
    match (code, status) {
        // 501 is an unknown function, 507 a full store.
        (_, Some(307 | 408 | 425 | 429 | 500 | 502..=504 | 508..)) => true,
        (Some(code), _) => matches!(
            code,
            "BadDigest"
                | "ConcurrentModification"
                | "ConditionalRequestConflict"
                | "IncompleteBody"
                | "InternalError"
                | "OperationAborted"
                | "RequestTimeout"
                | "ServiceUnavailable"
                | "SlowDown"
                | "SlowDownRead"
                | "SlowDownWrite"
                | "Throttling"
                | "XAmzContentSHA256Mismatch"
        ),
        (None, status) => status.is_none(),
    }
}

/// Returns the HTTP status of the reply that an error quotes.
fn status_of(error: &object_store::Error) -> Option<u16> {
    let text = error.to_string();
    let (_, rest) = text.split_once("status code: ")?;
    rest.get(..3)?.parse().ok()
}

/// Returns whether the code of an error is about credentials or permissions, whatever its HTTP status is.
fn is_refusal(code: &str) -> bool {
    matches!(
        code,
        "AccessDenied"
            | "ExpiredToken"
            | "InvalidAccessKeyId"
            | "InvalidToken"
            | "RequestTimeTooSkewed"
            | "SignatureDoesNotMatch"
            | "TokenRefreshRequired"
    )
}

/// Returns the `<Code>` of the reply that an error quotes.
fn code_of(error: &object_store::Error) -> Option<String> {
    let text = error.to_string();
    let (_, rest) = text.split_once("<Code>")?;
    let (code, _) = rest.split_once("</Code>")?;
    let is_word = !code.is_empty() && code.bytes().all(|byte| byte.is_ascii_alphanumeric());
    (is_word && code.len() <= 64).then(|| code.to_owned())
}

/// Returns why the certificate of the server was refused, if this is the cause of an error.
fn certificate_fault(error: &object_store::Error) -> Option<String> {
    let mut cause: &dyn Error = error;
    while let Some(next) = cause.source() {
        cause = next;
    }
    let text = cause.to_string();
    let (_, reason) = text.split_once("invalid peer certificate: ")?;
    let line = reason.lines().next()?;
    Some(line.chars().take(300).collect())
}

/// Returns the last cause of an error in one line. Causes that quote a reply of the store are left out.
fn innermost(error: &object_store::Error) -> String {
    let mut cause: &dyn Error = error;
    while let Some(next) = cause.source() {
        cause = next;
    }
    let text = cause.to_string();
    if text.contains('<') || text.len() > 200 {
        return "unexpected reply".to_owned();
    }
    let line = text.lines().next().unwrap_or_default();
    line.trim_end_matches([':', ' ']).to_owned()
}

#[cfg(test)]
mod tests {
    use super::BucketError;

    fn generic(text: &str) -> object_store::Error {
        object_store::Error::Generic {
            store: "S3",
            source: text.to_owned().into(),
        }
    }

    #[test]
    fn the_code_of_a_reply_decides_and_the_reply_is_not_quoted() {
        let reply = "status 400: <Error><Code>ExpiredToken</Code><AWSAccessKeyId>AKIASECRET</AWSAccessKeyId></Error>";
        let error = BucketError::of("s3://b/x", &generic(reply));
        let text = error.to_string();
        assert!(text.contains("(ExpiredToken)"), "{text}");
        assert!(!text.contains("AKIA"), "{text}");
        let error = BucketError::of("s3://b", &generic("404: <Code>NoSuchBucket</Code>"));
        assert!(matches!(error, BucketError::NoBucket(_)), "{error}");
        let refused = generic("invalid peer certificate: UnknownIssuer");
        let error = BucketError::of("s3://b", &refused);
        assert!(matches!(error, BucketError::Certificate { .. }), "{error}");
        let error = BucketError::of("s3://b", &generic("<html>AKIASECRET</html>"));
        assert!(error.to_string().contains("unexpected reply"), "{error}");
    }

    #[test]
    fn only_replies_that_may_change_are_waited_for() {
        let is_waited_for = |text: &str| {
            let error = BucketError::of("s3://b/x", &generic(text));
            matches!(error, BucketError::Unavailable { .. })
        };
        for temporary in [
            "Server returned non-2xx status code: 503 Service Unavailable: <Code>SlowDown</Code>",
            "Server returned non-2xx status code: 502 Bad Gateway: <html></html>",
            "Server returned non-2xx status code: 429 Too Many Requests: ",
            "Server returned non-2xx status code: 400 Bad Request: <Code>RequestTimeout</Code>",
            "Server returned error response: <Error><Code>InternalError</Code></Error>",
            "Server returned non-2xx status code: 400 Bad Request: <Code>IncompleteBody</Code>",
            "connection refused",
        ] {
            assert!(is_waited_for(temporary), "{temporary}");
        }
        for lasting in [
            "Server returned non-2xx status code: 400 Bad Request: <Code>EntityTooLarge</Code>",
            "Server returned non-2xx status code: 413 Payload Too Large: <html></html>",
            "Server returned non-2xx status code: 507 Insufficient Storage: <Code>XMinioStorageFull</Code>",
            "Server returned non-2xx status code: 501 Not Implemented: <Code>NotImplemented</Code>",
            "Received redirect without LOCATION, this normally indicates an incorrectly configured region",
        ] {
            assert!(!is_waited_for(lasting), "{lasting}");
        }
        // An archived object concerns no other object.
        let source = "status code: 403 Forbidden: <Code>InvalidObjectState</Code>";
        let archived = object_store::Error::PermissionDenied {
            path: "x".to_owned(),
            source: source.into(),
        };
        let error = BucketError::of("s3://b/x", &archived);
        assert_eq!(
            error.to_string(),
            "s3://b/x: the object store refuses this object (InvalidObjectState; it is archived: restore it first)"
        );
        // A full quota is not a matter of keys.
        let source = "status code: 403 Forbidden: <Code>QuotaExceeded</Code>";
        let full = object_store::Error::PermissionDenied {
            path: "x".to_owned(),
            source: source.into(),
        };
        let error = BucketError::of("s3://b/x", &full);
        assert!(matches!(error, BucketError::Failed { .. }), "{error}");
    }
}
