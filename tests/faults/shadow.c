/* Records, in the process that preloads this library, what a disk would hold after a power cut.
 *
 * SHADOW_OF  the folder to watch, without links in its path
 * SHADOW_IN  the folder for the record, outside of SHADOW_OF
 *
 * Every successful sync of a file or folder below SHADOW_OF adds a line `NUMBER file INODE` or `NUMBER folder INODE` to
 * SHADOW_IN/log. NUMBER.file holds the synced bytes, and NUMBER.names all names at that time, in lines of
 * `FOLDER-INODE INODE d|f NAME`. A synced file stays open, so that no other file gets its inode.
 */
#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char *watched, *notes;
static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static long number;
static ino_t open_inodes[65536];
static size_t open_count;

__attribute__((constructor)) static void begin(void) {
    watched = getenv("SHADOW_OF");
    notes = getenv("SHADOW_IN");
}

static void must(int condition, const char *what) {
    if (!condition) {
        perror(what);
        abort();
    }
}

static FILE *create(const char *name, const char *mode) {
    char path[PATH_MAX];
    snprintf(path, sizeof path, "%s/%s", notes, name);
    FILE *file = fopen(path, mode);
    must(file != NULL, path);
    return file;
}

static int is_below(int fd) {
    char link[64], path[PATH_MAX];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t length = readlink(link, path, sizeof path - 1);
    if (length < 0) {
        return 0;
    }
    path[length] = 0;
    size_t root = strlen(watched);
    return strncmp(path, watched, root) == 0 && (path[root] == '/' || path[root] == 0);
}

static void keep_open(int fd, ino_t inode) {
    for (size_t i = 0; i < open_count; i++) {
        if (open_inodes[i] == inode) {
            return;
        }
    }
    must(open_count < sizeof open_inodes / sizeof *open_inodes && fcntl(fd, F_DUPFD_CLOEXEC, 0) >= 0, "a file kept open");
    open_inodes[open_count++] = inode;
}

/* Copies the bytes of a file. A write-only file is opened again to be read, and that descriptor is never closed, because
 * closing it would release SQLite's locks on the file. */
static void copy_bytes(int fd) {
    char name[32], link[64], bytes[65536];
    snprintf(name, sizeof name, "%ld.file", number);
    FILE *out = create(name, "w");
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    int in = (fcntl(fd, F_GETFL) & O_ACCMODE) == O_WRONLY ? open(link, O_RDONLY | O_CLOEXEC) : fd;
    must(in >= 0, link);
    off_t at = 0;
    for (ssize_t got; (got = pread(in, bytes, sizeof bytes, at)) != 0; at += got) {
        must(got > 0 && fwrite(bytes, 1, (size_t)got, out) == (size_t)got, name);
    }
    must(fclose(out) == 0, name);
}

static void list(FILE *out, const char *path) {
    struct stat folder;
    DIR *open = opendir(path);
    if (!open || fstat(dirfd(open), &folder) != 0) {
        /* Removed since its name was read. */
        if (open) {
            closedir(open);
        }
        return;
    }
    for (struct dirent *entry; (entry = readdir(open));) {
        if (strcmp(entry->d_name, ".") == 0 || strcmp(entry->d_name, "..") == 0) {
            continue;
        }
        int is_folder = entry->d_type == DT_DIR;
        fprintf(out, "%lu %lu %c %s\n", (unsigned long)folder.st_ino, (unsigned long)entry->d_ino,
                is_folder ? 'd' : 'f', entry->d_name);
        if (is_folder) {
            char below[PATH_MAX];
            snprintf(below, sizeof below, "%s/%s", path, entry->d_name);
            list(out, below);
        }
    }
    closedir(open);
}

static void record(int fd) {
    struct stat found;
    must(fstat(fd, &found) == 0, "a synced file");
    int is_folder = S_ISDIR(found.st_mode);
    number++;
    keep_open(fd, found.st_ino);
    if (!is_folder) {
        copy_bytes(fd);
    }
    char name[32];
    snprintf(name, sizeof name, "%ld.names", number);
    FILE *names = create(name, "w");
    list(names, watched);
    must(fclose(names) == 0, name);
    FILE *log = create("log", "a");
    fprintf(log, "%ld %s %lu\n", number, is_folder ? "folder" : "file", (unsigned long)found.st_ino);
    must(fclose(log) == 0, "log");
}

static int sync_with(const char *name, int fd) {
    int (*real)(int) = (int (*)(int))dlsym(RTLD_NEXT, name);
    if (!watched || !notes || !is_below(fd)) {
        return real(fd);
    }
    pthread_mutex_lock(&mutex);
    int result = real(fd);
    if (result == 0) {
        record(fd);
    }
    pthread_mutex_unlock(&mutex);
    return result;
}

int fsync(int fd) { return sync_with("fsync", fd); }

int fdatasync(int fd) { return sync_with("fdatasync", fd); }
