//! Detects network file systems. The write-ahead log needs shared memory, which does not work on them.

use std::path::Path;

use crate::db::error::{CatalogError, Result};
use mocban_system::platform::{DeviceNumber, device_number, file_system_magic, is_share};

/// Number (`f_type`) and name of each network file system, from statfs(2) and the kernel's `magic.h`.
const MAGICS: [(u64, &str); 20] = [
    (0x6969, "nfs"),
    (0x517b, "smb"),
    (0xff53_4d42, "cifs"),
    (0xfe53_4d42, "smb2"),
    (0x0102_1997, "9p"),
    (0x564c, "ncp"),
    (0x7375_7245, "coda"),
    (0x5346_414f, "afs"),
    (0x6b41_4653, "afs"),
    (0x00c3_6400, "ceph"),
    (0x0bd0_0bd0, "lustre"),
    (0x4750_4653, "gpfs"),
    (0x1983_0326, "beegfs"),
    (0x2003_0528, "orangefs"),
    (0xaad7_aaea, "panfs"),
    (0x7461_636f, "ocfs2"),
    (0x0116_1970, "gfs2"),
    (0x786f_4256, "vboxsf"),
    (0xbacb_acbc, "vmhgfs"),
    (0x7c7c_6673, "prl_fs"),
];

/// `f_type` of every FUSE file system.
const FUSE: u64 = 0x6573_5546;

/// Names of FUSE file systems that use a network. The mount table lists them with the prefix `fuse.`.
const FUSE_NETWORKS: &str = "sshfs rclone s3fs gcsfuse glusterfs ceph-fuse davfs curlftpfs smbnetfs juicefs mfs \
    lizardfs goofys blobfuse blobfuse2 gvfsd-fuse onedriver google-drive-ocamlfuse";

/// Refuses a catalog on a network file system. An unknown file system counts as local.
///
/// # Errors
/// Returns an error if the catalog is on a network file system.
pub(crate) fn refuse(catalog: &Path) -> Result<()> {
    let dir = catalog.parent().filter(|dir| !dir.as_os_str().is_empty());
    let dir = dir.unwrap_or(Path::new("."));
    match found(dir) {
        Some(kind) => Err(CatalogError::NetworkFileSystem {
            path: dir.to_owned(),
            kind,
        }),
        None => Ok(()),
    }
}

fn found(dir: &Path) -> Option<&'static str> {
    if is_share(dir) {
        return Some("a Windows share");
    }
    let magic = file_system_magic(dir)?;
    let mount = (magic == FUSE).then(|| mount_type(dir)).flatten();
    network_kind(magic, mount.as_deref())
}

/// Returns the file system type of a directory in the mount table.
fn mount_type(dir: &Path) -> Option<String> {
    let DeviceNumber { major, minor, .. } = device_number(dir)?;
    let number = format!("{major}:{minor}");
    let table = std::fs::read_to_string("/proc/self/mountinfo").ok()?;
    type_of_device(&table, &number).map(ToOwned::to_owned)
}

/// Returns the file system type of a device from the text of `/proc/self/mountinfo`. In each line, the third field is
/// the device number. The first field after a single `-` is the type.
fn type_of_device<'a>(table: &'a str, number: &str) -> Option<&'a str> {
    let line = table
        .lines()
        .rfind(|line| line.split(' ').nth(2) == Some(number))?;
    line.split_once(" - ")?.1.split(' ').next()
}

/// Returns the name of a network file system, or `None` for any other. `magic` is the `f_type`. `mount` is the type in
/// the mount table, which identifies FUSE file systems.
fn network_kind(magic: u64, mount: Option<&str>) -> Option<&'static str> {
    if magic == FUSE {
        let name = mount?.strip_prefix("fuse.")?;
        return FUSE_NETWORKS.split(' ').find(|known| *known == name);
    }
    let known = MAGICS.iter().find(|(known, _)| *known == magic);
    known.map(|(_, name)| *name)
}

#[cfg(test)]
mod tests {
    use super::{FUSE, network_kind, type_of_device};

    #[test]
    fn network_file_systems_are_recognized_by_number_and_local_disks_accepted() {
        for (magic, name) in [
            (0x6969, "nfs"),
            (0xff53_4d42, "cifs"),
            (0xfe53_4d42, "smb2"),
            (0x0102_1997, "9p"),
        ] {
            assert_eq!(network_kind(magic, None), Some(name));
        }
        // ext4, xfs, btrfs, tmpfs, overlay, zfs.
        for magic in [
            0xef53,
            0x5846_5342,
            0x9123_683e,
            0x0102_1994,
            0x794c_7630,
            0x2fc1_2fc1,
        ] {
            assert_eq!(network_kind(magic, None), None);
        }
    }

    #[test]
    fn fuse_file_systems_are_recognized_by_mount_type() {
        assert_eq!(network_kind(FUSE, Some("fuse.sshfs")), Some("sshfs"));
        assert_eq!(network_kind(FUSE, Some("fuse.gocryptfs")), None);
        assert_eq!(network_kind(FUSE, Some("fuseblk")), None);
        assert_eq!(network_kind(FUSE, None), None);
    }

    #[test]
    fn mount_type_is_found_by_device() {
        let table = "22 1 8:1 / / rw,relatime shared:1 - ext4 /dev/sda1 rw\n\
                     90 22 0:51 / /mnt/far rw,nosuid shared:7 master:2 - fuse.sshfs lan@far:/srv rw\n";
        assert_eq!(type_of_device(table, "0:51"), Some("fuse.sshfs"));
        assert_eq!(type_of_device(table, "8:1"), Some("ext4"));
        assert_eq!(type_of_device(table, "0:5"), None);
    }
}
