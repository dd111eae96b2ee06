//! The memory that this process can still take: what the machine has available, within the limits of its control
//! groups. Everything is read from the files of Linux; on other systems nothing is known.

use std::path::{Path, PathBuf};

/// Share of the free memory that a run takes by default.
const SHARE: f64 = 0.8;

/// Returns the memory limit of a run for which none was set, in bytes: 80 % of what is free now. `None` if the free
/// memory is not known.
pub fn default_memory_limit() -> Option<u64> {
    let free = free_memory(Path::new("/"))?;
    Some((free as f64 * SHARE) as u64)
}

/// Returns the free memory in bytes, given the directory below which `proc` and the control groups are mounted.
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
    /// Where the hierarchy is mounted. In a container this may be the container's own group.
    mount: PathBuf,
    /// The process's group: the mount point or a directory below it.
    dir: PathBuf,
}

/// Names of a control group's files.
#[derive(Debug, PartialEq, Eq)]
struct GroupFiles {
    /// Files with a limit in bytes. The smallest number counts, and other text means no limit.
    limits: &'static [&'static str],
    usage: &'static str,
    /// Field of `memory.stat`: bytes of the usage that are cached file contents, which the kernel gives up first.
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
    /// Finds the group in the hierarchy that controls memory: version 1 where it is mounted, else version 2.
    fn of_this_process(root: &Path) -> Option<Self> {
        let groups = std::fs::read_to_string(root.join("proc/self/cgroup")).ok()?;
        let mounts = std::fs::read_to_string(root.join("proc/self/mountinfo")).ok()?;
        let (files, path) = group_path(&groups)?;
        let (mount_root, mount) = mount_of(files, &mounts)?;
        let mount = root.join(mount.trim_start_matches('/'));
        // A path outside the mounted part of the hierarchy belongs to another namespace: then the mount point itself
        // is the nearest group that can be read.
        let below = Path::new(path).strip_prefix(mount_root).ok();
        let dir = below
            .filter(|below| !below.starts_with(".."))
            .map_or_else(|| mount.clone(), |below| mount.join(below));
        Some(Self { files, mount, dir })
    }

    /// Returns the smallest amount of memory, in bytes, that is left to the group or any of its ancestors. Returns
    /// `None` without a limit.
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

/// Finds the path of the memory group in `/proc/self/cgroup`: lines of `ID:CONTROLLERS:PATH`, where version 2 names no
/// controllers.
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

/// Finds where a hierarchy is mounted in `/proc/self/mountinfo`: the group that the mount point shows, and the mount
/// point. The fourth and the fifth field hold them; the file system and its options follow a lone `-`.
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

    /// Returns what is free on a machine with 1 GiB available and these further files.
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

    /// Returns what is free for a process of a version 2 group, with files below `/sys/fs/cgroup`.
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
        // In a namespace of its own; with the host's paths; and with a path outside the namespace.
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
