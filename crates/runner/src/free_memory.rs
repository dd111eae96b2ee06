//! Finds how much memory this process can still take: what the machine has available, within the limits of the control
//! groups. Reads files of Linux. On other systems the amount is unknown.

use std::path::{Path, PathBuf};

/// Fraction of the free memory that a run takes by default.
const SHARE: f64 = 0.8;

/// Returns the default memory limit of a run in bytes: 80 % of the free memory. Returns `None` if the free memory is
/// unknown.
pub fn default_memory_limit() -> Option<u64> {
    let free = free_memory(Path::new("/"))?;
    Some((free as f64 * SHARE) as u64)
}

/// Returns the free memory in bytes. Reads `proc` and the control groups below `root`.
fn free_memory(root: &Path) -> Option<u64> {
    let meminfo = std::fs::read_to_string(root.join("proc/meminfo")).ok();
    let machine = meminfo.as_deref().and_then(available);
    let groups = MemoryGroup::of_this_process(root).and_then(|group| group.free());
    machine.into_iter().chain(groups).min()
}

/// Returns `MemAvailable` of `/proc/meminfo` in bytes (`proc_meminfo(5)`).
fn available(meminfo: &str) -> Option<u64> {
    let line = meminfo
        .lines()
        .find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kib.checked_mul(1024)
}

/// The control group that limits this process's memory (`cgroups(7)`).
#[derive(Debug, PartialEq, Eq)]
struct MemoryGroup {
    files: &'static GroupFiles,
    /// Mount point of the control groups. In a container it may show only the container's own group.
    mount: PathBuf,
    /// The process's group: the mount point or a directory below it.
    dir: PathBuf,
}

/// Names of a control group's files.
#[derive(Debug, PartialEq, Eq)]
struct GroupFiles {
    /// Files that contain a limit in bytes. A file without a number means no limit. The smallest limit applies.
    limits: &'static [&'static str],
    usage: &'static str,
    /// Field of `memory.stat` with the bytes of cached file contents. The kernel frees these first if memory is short.
    reclaimable: &'static str,
}

const VERSION_1: GroupFiles = GroupFiles {
    limits: &["memory.limit_in_bytes"],
    usage: "memory.usage_in_bytes",
    reclaimable: "total_inactive_file",
};
const VERSION_2: GroupFiles = GroupFiles {
    limits: &["memory.max", "memory.high"],
    usage: "memory.current",
    reclaimable: "inactive_file",
};

impl MemoryGroup {
    /// Finds the group that limits this process. Uses cgroup version 1 if it controls memory, otherwise version 2.
    fn of_this_process(root: &Path) -> Option<Self> {
        let groups = std::fs::read_to_string(root.join("proc/self/cgroup")).ok()?;
        let mounts = std::fs::read_to_string(root.join("proc/self/mountinfo")).ok()?;
        let (files, path) = group_path(&groups)?;
        let (mount_root, mount) = mount_of(files, &mounts)?;
        let mount = root.join(mount.trim_start_matches('/'));
        // A path outside the mounted groups belongs to another namespace. In that case the nearest group that can be
        // read is the mount point itself.
        let below = Path::new(path).strip_prefix(mount_root).ok();
        let dir = below
            .filter(|below| !below.starts_with(".."))
            .map_or_else(|| mount.clone(), |below| mount.join(below));
        Some(Self { files, mount, dir })
    }

    /// Returns how many bytes the group may still take within its own limits and those of its ancestors. Returns `None`
    /// if there is no limit.
    fn free(&self) -> Option<u64> {
        let groups = self.dir.ancestors();
        let groups = groups.take_while(|dir| dir.starts_with(&self.mount));
        groups.filter_map(|dir| self.files.free_in(dir)).min()
    }
}

impl GroupFiles {
    /// Returns the limit of a group minus its usage, in bytes. Reclaimable cache counts as free.
    fn free_in(&self, dir: &Path) -> Option<u64> {
        let text = |name: &str| std::fs::read_to_string(dir.join(name)).ok();
        let number = |name: &str| text(name)?.trim().parse::<u64>().ok();
        let limit = self.limits.iter().filter_map(|name| number(name)).min()?;
        let used = number(self.usage).unwrap_or(0);
        let stat = text("memory.stat");
        let reclaimable = stat.and_then(|stat| {
            let mut fields = stat.lines().filter_map(|line| line.split_once(' '));
            let (_, bytes) = fields.find(|(name, _)| *name == self.reclaimable)?;
            bytes.trim().parse().ok()
        });
        let used = used.saturating_sub(reclaimable.unwrap_or(0));
        Some(limit.saturating_sub(used))
    }
}

/// Finds the path of this process's memory group in the text of `/proc/self/cgroup`. Each line has the form
/// `ID:CONTROLLERS:PATH`. For version 2, CONTROLLERS is empty.
fn group_path(groups: &str) -> Option<(&'static GroupFiles, &str)> {
    let lines = || {
        groups
            .lines()
            .filter_map(|line| line.split_once(':')?.1.split_once(':'))
    };
    let path_where = |is_ours: fn(&str) -> bool| {
        let mut lines = lines();
        lines.find_map(|(controllers, path)| is_ours(controllers).then_some(path))
    };
    let version_1 = path_where(|controllers| controllers.split(',').any(|one| one == "memory"));
    let version_2 = || Some((&VERSION_2, path_where(str::is_empty)?));
    version_1.map(|path| (&VERSION_1, path)).or_else(version_2)
}

/// Finds the mount of the control groups in the text of `/proc/self/mountinfo`. Returns the mounted group (fourth
/// field) and the mount point (fifth field). The file system's type and options follow ` - `.
fn mount_of<'m>(files: &GroupFiles, mounts: &'m str) -> Option<(&'m str, &'m str)> {
    mounts.lines().find_map(|line| {
        let (mount, file_system) = line.split_once(" - ")?;
        let mut fields = file_system.split(' ');
        let (kind, options) = (fields.next()?, fields.nth(1).unwrap_or(""));
        let is_ours = if *files == VERSION_2 {
            kind == "cgroup2"
        } else {
            kind == "cgroup" && options.split(',').any(|option| option == "memory")
        };
        let mut fields = mount.split(' ').skip(3);
        is_ours.then_some((fields.next()?, fields.next()?))
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{available, free_memory};

    const V2_MOUNT: &str =
        "30 23 0:26 / /sys/fs/cgroup rw,nosuid - cgroup2 cgroup2 rw,nsdelegate\n";
    const V1_MOUNTS: &str = "31 30 0:27 / /sys/fs/cgroup/cpu rw - cgroup cgroup rw,cpu,cpuacct\n\
        32 30 0:28 / /sys/fs/cgroup/memory rw - cgroup cgroup rw,memory\n";
    const MACHINE: u64 = 1 << 30;

    /// Returns the free memory in bytes for a machine with these files and 1 GiB available.
    fn free(files: &[(&str, &str)]) -> Option<u64> {
        let root = tempfile::tempdir().expect("a temporary directory");
        let write = |path: &str, text: &str| {
            let path = root.path().join(path);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            std::fs::write(path, text).expect("a file");
        };
        write(
            "proc/meminfo",
            "MemTotal: 4194304 kB\nMemAvailable:    1048576 kB\n",
        );
        for (path, text) in files {
            write(path, text);
        }
        free_memory(root.path())
    }

    /// Returns the free memory in bytes for a process in a version 2 `group`. `files` are below `/sys/fs/cgroup`.
    fn free_in_v2(group: &str, mount: &str, files: &[(&str, &str)]) -> Option<u64> {
        let groups = format!("0::{group}\n");
        let mut all = vec![
            ("proc/self/cgroup".to_owned(), groups.as_str()),
            ("proc/self/mountinfo".to_owned(), mount),
        ];
        for (path, text) in files {
            all.push((format!("sys/fs/cgroup/{path}"), text));
        }
        let all: Vec<_> = all
            .iter()
            .map(|(path, text)| (path.as_str(), *text))
            .collect();
        free(&all)
    }

    #[test]
    fn without_groups_the_machine_counts() {
        assert_eq!(free(&[]), Some(MACHINE));
        assert_eq!(available("MemTotal: 1 kB\n"), None);
        assert_eq!(free_memory(Path::new("/nonexistent")), None);
    }

    #[test]
    fn the_smallest_limit_among_the_ancestors_counts_without_reclaimable_cache() {
        let found = free_in_v2(
            "/user.slice/job.scope",
            V2_MOUNT,
            &[
                ("user.slice/job.scope/memory.max", "max\n"),
                ("user.slice/job.scope/memory.current", "5000\n"),
                ("user.slice/memory.max", "100000\n"),
                ("user.slice/memory.current", "30000\n"),
                (
                    "user.slice/memory.stat",
                    "anon 7\ninactive_file 20000\nslab 1\n",
                ),
                // The limit of a group that this process is not in.
                ("system.slice/memory.max", "1\n"),
            ],
        );
        assert_eq!(found, Some(90_000));
    }

    #[test]
    fn a_soft_limit_counts_and_a_group_over_its_limit_has_nothing_left() {
        let limits = |max, high, current| {
            let files = [
                ("a/memory.max", max),
                ("a/memory.high", high),
                ("a/memory.current", current),
            ];
            free_in_v2("/a", V2_MOUNT, &files)
        };
        assert_eq!(limits("900", "500", "100"), Some(400));
        assert_eq!(limits("900", "max", "1000"), Some(0));
        assert_eq!(limits("max", "max", "1000"), Some(MACHINE));
    }

    #[test]
    fn a_container_whose_group_is_mounted_as_the_root_is_limited_by_it() {
        let limit = [("memory.max", "5000"), ("memory.current", "1000")];
        // The path in /proc/self/cgroup is relative to the namespace of the process ("/"), relative to the host's root
        // ("/docker/7f"), or outside the namespace ("/../other").
        assert_eq!(free_in_v2("/", V2_MOUNT, &limit), Some(4000));
        let mount = V2_MOUNT.replace(" / /sys", " /docker/7f /sys");
        assert_eq!(free_in_v2("/docker/7f", &mount, &limit), Some(4000));
        assert_eq!(free_in_v2("/../other", V2_MOUNT, &limit), Some(4000));
        let nested = [("memory.max", "5000"), ("job/memory.max", "3000")];
        assert_eq!(free_in_v2("/docker/7f/job", &mount, &nested), Some(3000));
    }

    #[test]
    fn version_1_is_read_from_its_memory_hierarchy() {
        let found = |path: &str| {
            let groups = format!("7:cpu,cpuacct:/other\n6:memory:{path}\n0::/user.slice\n");
            free(&[
                ("proc/self/cgroup", groups.as_str()),
                ("proc/self/mountinfo", V1_MOUNTS),
                (
                    "sys/fs/cgroup/memory/memory.limit_in_bytes",
                    "9223372036854771712\n",
                ),
                ("sys/fs/cgroup/memory/batch/memory.limit_in_bytes", "8000\n"),
                ("sys/fs/cgroup/memory/batch/memory.usage_in_bytes", "3000\n"),
                (
                    "sys/fs/cgroup/memory/batch/memory.stat",
                    "inactive_file 9\ntotal_inactive_file 1000\n",
                ),
            ])
        };
        assert_eq!(found("/batch/job"), Some(6000));
        assert_eq!(found("/"), Some(MACHINE));
    }
}
