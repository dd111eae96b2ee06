/* Makes chosen system calls fail in the process that preloads this library.
 *
 * FAULT_CALL     open, stat, fstat, list, read, write, sync, rename, truncate, unlink, mkdir, rmdir, chmod, flock or lock;
 *                any for all of them except lock
 * FAULT_PATH     pattern (fnmatch) for the file's absolute path; for a rename, for either path
 * FAULT_NTH      number of the first matching call that fails, from 1; 0 for none
 * FAULT_TIMES    number of calls that fail from there on, 1 by default; 0 for all
 * FAULT_ERROR    error number; with 0 the call succeeds
 * FAULT_SHORT    if set, the first of these calls writes half of its bytes, like on a nearly full disk
 * FAULT_DELAY_MS delay before each of these calls in milliseconds
 * FAULT_NO_SLEEP if set, the process never sleeps, so that waiting for a lock takes no time
 * FAULT_LOG      file that gets a line for every matching call
 * FAULT_MARK     file that gets a line for every call with an injected fault
 */
#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <fnmatch.h>
#include <limits.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

#define REAL(name) ((__typeof__(&name))real(#name))

static struct {
    const char *call, *path, *log, *mark;
    long nth, times, delay_ms;
    int error, half, no_sleep;
} plan;

static atomic_long calls;

static void *real(const char *name) { return dlsym(RTLD_NEXT, name); }

static long number(const char *name, long fallback) {
    const char *text = getenv(name);
    return text ? atol(text) : fallback;
}

__attribute__((constructor)) static void read_plan(void) {
    plan.call = getenv("FAULT_CALL");
    plan.path = getenv("FAULT_PATH");
    plan.log = getenv("FAULT_LOG");
    plan.mark = getenv("FAULT_MARK");
    plan.nth = number("FAULT_NTH", 0);
    plan.times = number("FAULT_TIMES", 1);
    plan.error = (int)number("FAULT_ERROR", 0);
    plan.delay_ms = number("FAULT_DELAY_MS", 0);
    plan.half = getenv("FAULT_SHORT") != NULL;
    plan.no_sleep = getenv("FAULT_NO_SLEEP") != NULL;
}

/* Adds a line to a file by raw system calls, which this library does not intercept. */
static void note(const char *file, const char *call, const char *path) {
    char line[PATH_MAX + 32];
    int length = snprintf(line, sizeof line, "%s %s\n", call, path);
    long fd = syscall(SYS_openat, AT_FDCWD, file, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
    if (fd < 0 || length < 0 || syscall(SYS_write, fd, line, (size_t)length) != length) {
        abort();
    }
    syscall(SYS_close, fd);
}

enum verdict { PASS, FAIL, HALF };

static int is_planned(const char *call) {
    if (!plan.call) {
        return 0;
    }
    return strcmp(plan.call, "any") == 0 ? strcmp(call, "lock") != 0 : strcmp(call, plan.call) == 0;
}

/* Decides about a call; sets errno if it is to fail. */
static enum verdict judge(const char *call, const char *path, const char *other) {
    if (!plan.path || !is_planned(call)) {
        return PASS;
    }
    if (fnmatch(plan.path, path, 0) != 0 && (!other || fnmatch(plan.path, other, 0) != 0)) {
        return PASS;
    }
    int before = errno;
    long which = atomic_fetch_add(&calls, 1) + 1;
    if (plan.log) {
        note(plan.log, call, path);
    }
    if (plan.nth == 0 || which < plan.nth || (plan.times && which >= plan.nth + plan.times)) {
        errno = before;
        return PASS;
    }
    if (plan.mark) {
        note(plan.mark, call, path);
    }
    if (plan.delay_ms) {
        struct timespec delay = {plan.delay_ms / 1000, plan.delay_ms % 1000 * 1000000};
        while (syscall(SYS_nanosleep, &delay, &delay) != 0 && errno == EINTR) {
        }
    }
    if (plan.half && which == plan.nth) {
        return HALF;
    }
    errno = plan.error ? plan.error : before;
    return plan.error ? FAIL : PASS;
}

/* Decides about a call on an open file. */
static enum verdict judge_file(const char *call, int fd) {
    if (!is_planned(call)) {
        return PASS;
    }
    char link[64], path[PATH_MAX];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t length = readlink(link, path, sizeof path - 1);
    if (length < 0) {
        return PASS;
    }
    path[length] = 0;
    return judge(call, path, NULL);
}

/* Decides about a call on a path below an open folder. */
static enum verdict judge_at(const char *call, int folder, const char *path) {
    char link[64], whole[PATH_MAX];
    if (!is_planned(call)) {
        return PASS;
    }
    if (path[0] == '/' || folder == AT_FDCWD) {
        return judge(call, path, NULL);
    }
    snprintf(link, sizeof link, "/proc/self/fd/%d", folder);
    ssize_t length = readlink(link, whole, sizeof whole - 2 - strlen(path));
    if (length < 0) {
        return PASS;
    }
    snprintf(whole + length, sizeof whole - (size_t)length, "/%s", path);
    return judge(call, whole, NULL);
}

static size_t part(enum verdict verdict, size_t count) { return verdict == HALF ? (count + 1) / 2 : count; }

#define OPEN(name)                                                                                                     \
    int name(const char *path, int flags, ...) {                                                                       \
        va_list rest;                                                                                                  \
        va_start(rest, flags);                                                                                         \
        mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(rest, mode_t) : 0;                                        \
        va_end(rest);                                                                                                  \
        return judge("open", path, NULL) == FAIL ? -1 : REAL(name)(path, flags, mode);                                 \
    }
OPEN(open)
OPEN(open64)

int openat64(int folder, const char *path, int flags, ...) {
    va_list rest;
    va_start(rest, flags);
    mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(rest, mode_t) : 0;
    va_end(rest);
    return judge_at("open", folder, path) == FAIL ? -1 : REAL(openat64)(folder, path, flags, mode);
}

DIR *opendir(const char *path) { return judge("list", path, NULL) == FAIL ? NULL : REAL(opendir)(path); }

struct dirent64 *readdir64(DIR *folder) {
    return judge_file("list", dirfd(folder)) == FAIL ? NULL : REAL(readdir64)(folder);
}

int statx(int folder, const char *path, int flags, unsigned mask, struct statx *found) {
    /* Rust asks once without a path whether the call exists, which its declaration does not allow. */
    const char *volatile given = path;
    if (given && (*given ? judge_at("stat", folder, path) : judge_file("fstat", folder)) == FAIL) {
        return -1;
    }
    return REAL(statx)(folder, path, flags, mask, found);
}

int stat64(const char *path, struct stat64 *found) {
    return judge("stat", path, NULL) == FAIL ? -1 : REAL(stat64)(path, found);
}

int lstat64(const char *path, struct stat64 *found) {
    return judge("stat", path, NULL) == FAIL ? -1 : REAL(lstat64)(path, found);
}

int fstat64(int fd, struct stat64 *found) {
    return judge_file("fstat", fd) == FAIL ? -1 : REAL(fstat64)(fd, found);
}

int unlinkat(int folder, const char *path, int flags) {
    const char *call = flags & AT_REMOVEDIR ? "rmdir" : "unlink";
    return judge_at(call, folder, path) == FAIL ? -1 : REAL(unlinkat)(folder, path, flags);
}

int rmdir(const char *path) { return judge("rmdir", path, NULL) == FAIL ? -1 : REAL(rmdir)(path); }

int chmod(const char *path, mode_t mode) { return judge("chmod", path, NULL) == FAIL ? -1 : REAL(chmod)(path, mode); }

int flock(int fd, int operation) { return judge_file("flock", fd) == FAIL ? -1 : REAL(flock)(fd, operation); }

ssize_t read(int fd, void *bytes, size_t count) {
    return judge_file("read", fd) == FAIL ? -1 : REAL(read)(fd, bytes, count);
}

ssize_t pread64(int fd, void *bytes, size_t count, off64_t at) {
    return judge_file("read", fd) == FAIL ? -1 : REAL(pread64)(fd, bytes, count, at);
}

ssize_t write(int fd, const void *bytes, size_t count) {
    enum verdict verdict = judge_file("write", fd);
    return verdict == FAIL ? -1 : REAL(write)(fd, bytes, part(verdict, count));
}

ssize_t pwrite64(int fd, const void *bytes, size_t count, off64_t at) {
    enum verdict verdict = judge_file("write", fd);
    return verdict == FAIL ? -1 : REAL(pwrite64)(fd, bytes, part(verdict, count), at);
}

ssize_t writev(int fd, const struct iovec *parts, int count) {
    enum verdict verdict = judge_file("write", fd);
    return verdict == FAIL ? -1 : REAL(writev)(fd, parts, (int)part(verdict, (size_t)count));
}

int fsync(int fd) { return judge_file("sync", fd) == FAIL ? -1 : REAL(fsync)(fd); }

int fdatasync(int fd) { return judge_file("sync", fd) == FAIL ? -1 : REAL(fdatasync)(fd); }

int ftruncate64(int fd, off64_t length) {
    return judge_file("truncate", fd) == FAIL ? -1 : REAL(ftruncate64)(fd, length);
}

int rename(const char *from, const char *to) {
    return judge("rename", from, to) == FAIL ? -1 : REAL(rename)(from, to);
}

int unlink(const char *path) { return judge("unlink", path, NULL) == FAIL ? -1 : REAL(unlink)(path); }

int mkdir(const char *path, mode_t mode) { return judge("mkdir", path, NULL) == FAIL ? -1 : REAL(mkdir)(path, mode); }

/* Returns whether another process may hold this SQLite lock for long: to write, to recover, or to checkpoint the WAL. The
 * read marks, bytes 124 to 127 of the index, are locked exclusively for an instant only. */
static int is_contended(const struct flock *lock) {
    return lock->l_type == F_WRLCK && (lock->l_start < 124 || lock->l_start > 127);
}

/* Implements fcntl and fcntl64. */
static int control(const char *name, int fd, int command, void *argument) {
    if (command == F_SETLK && is_contended(argument) && judge_file("lock", fd) == FAIL) {
        return -1;
    }
    return ((int (*)(int, int, ...))real(name))(fd, command, argument);
}

#define CONTROL(name)                                                                                                  \
    int name(int fd, int command, ...) {                                                                               \
        va_list rest;                                                                                                  \
        va_start(rest, command);                                                                                       \
        void *argument = va_arg(rest, void *);                                                                         \
        va_end(rest);                                                                                                  \
        return control(#name, fd, command, argument);                                                                  \
    }
CONTROL(fcntl)
CONTROL(fcntl64)

int nanosleep(const struct timespec *time, struct timespec *left) {
    return plan.no_sleep ? 0 : REAL(nanosleep)(time, left);
}
