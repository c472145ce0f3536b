/* Writes down every change a program makes to the files of one folder: preload it, give TAP_FOLDER and TAP_LOG.
 * Each entry: one letter, path length, offset, data length (u32, u64, u64), path, data. W write, S sync, T truncate,
 * U unlink, R rename (data = new path). A test rebuilds from it every state that a power cut can leave.
 * While the file that TAP_FULL names exists, the disk is full; while TAP_READONLY's does, it cannot be written at all. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <unistd.h>

static int log_fd = -2;
static const char *folder;

static int ours(const char *path) {
    if (log_fd == -2) {
        folder = getenv("TAP_FOLDER");
        const char *log = getenv("TAP_LOG");
        log_fd = folder && log ? (int)syscall(SYS_openat, AT_FDCWD, log, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600) : -1;
    }
    return log_fd >= 0 && strncmp(path, folder, strlen(folder)) == 0;
}

static int path_of(int fd, char *path, size_t size) {
    char link[64];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t got = readlink(link, path, size - 1);
    if (got <= 0) return 0;
    path[got] = 0;
    return ours(path);
}

static void note(char what, const char *path, uint64_t offset, const void *data, uint64_t size) {
    static ssize_t (*real)(int, const void *, size_t);
    if (!real) real = dlsym(RTLD_NEXT, "write");
    uint32_t length = strlen(path);
    size_t total = 1 + 4 + 8 + 8 + length + size;
    char *entry = malloc(total), *at = entry;
    *at++ = what;
    memcpy(at, &length, 4), at += 4;
    memcpy(at, &offset, 8), at += 8;
    memcpy(at, &size, 8), at += 8;
    memcpy(at, path, length), at += length;
    if (size) memcpy(at, data, size);
    if (real(log_fd, entry, total) != (ssize_t)total) _exit(99);
    free(entry);
}

static int is_set(const char *name) {
    const char *path = getenv(name);
    return path && syscall(SYS_faccessat, AT_FDCWD, path, F_OK) == 0;
}

/* What a write to the disk fails with now; 0 = it does not. */
static int trouble(void) { return is_set("TAP_READONLY") ? EROFS : is_set("TAP_FULL") ? ENOSPC : 0; }

#define FAIL(error) do { int found = (error); if (found) { errno = found; return -1; } } while (0)
#define READONLY (is_set("TAP_READONLY") ? EROFS : 0)
#define REAL(type, name, ...) static type (*real)(__VA_ARGS__); if (!real) real = dlsym(RTLD_NEXT, name)

static ssize_t tapped_pwrite(ssize_t (*real)(int, const void *, size_t, off64_t), int fd, const void *data, size_t size, off64_t at) {
    char path[4096];
    if (path_of(fd, path, sizeof path)) {
        FAIL(trouble());
        note('W', path, at, data, size);
    }
    return real(fd, data, size, at);
}
ssize_t pwrite64(int fd, const void *data, size_t size, off64_t at) {
    REAL(ssize_t, "pwrite64", int, const void *, size_t, off64_t);
    return tapped_pwrite(real, fd, data, size, at);
}
ssize_t pwrite(int fd, const void *data, size_t size, off_t at) {
    REAL(ssize_t, "pwrite64", int, const void *, size_t, off64_t);
    return tapped_pwrite(real, fd, data, size, at);
}
ssize_t write(int fd, const void *data, size_t size) {
    REAL(ssize_t, "write", int, const void *, size_t);
    char path[4096];
    if (fd > 2 && fd != log_fd && path_of(fd, path, sizeof path)) {
        FAIL(trouble());
        off_t at = fcntl(fd, F_GETFL) & O_APPEND ? lseek(fd, 0, SEEK_END) : lseek(fd, 0, SEEK_CUR);
        note('W', path, at, data, size);
    }
    return real(fd, data, size);
}
int fsync(int fd) {
    REAL(int, "fsync", int);
    char path[4096];
    if (path_of(fd, path, sizeof path)) note('S', path, 0, "", 0);
    return real(fd);
}
int fdatasync(int fd) {
    REAL(int, "fdatasync", int);
    char path[4096];
    if (path_of(fd, path, sizeof path)) note('S', path, 0, "", 0);
    return real(fd);
}
int ftruncate64(int fd, off64_t size) {
    REAL(int, "ftruncate64", int, off64_t);
    char path[4096];
    if (path_of(fd, path, sizeof path)) {
        FAIL(READONLY);
        note('T', path, size, "", 0);
    }
    return real(fd, size);
}
int ftruncate(int fd, off_t size) { return ftruncate64(fd, size); }
int unlink(const char *path) {
    REAL(int, "unlink", const char *);
    if (ours(path)) {
        FAIL(READONLY);
        note('U', path, 0, "", 0);
    }
    return real(path);
}
int rename(const char *from, const char *to) {
    REAL(int, "rename", const char *, const char *);
    if (ours(from)) {
        FAIL(READONLY);
        note('R', from, 0, to, strlen(to));
    }
    return real(from, to);
}

static int opened(int (*real)(const char *, int, ...), const char *path, int flags, va_list more) {
    mode_t mode = flags & O_CREAT ? va_arg(more, mode_t) : 0;
    if (ours(path) && (flags & (O_WRONLY | O_RDWR | O_CREAT))) FAIL(READONLY);
    return real(path, flags, mode);
}
int open64(const char *path, int flags, ...) {
    REAL(int, "open64", const char *, int, ...);
    va_list more;
    va_start(more, flags);
    int fd = opened(real, path, flags, more);
    va_end(more);
    return fd;
}
int open(const char *path, int flags, ...) {
    REAL(int, "open", const char *, int, ...);
    va_list more;
    va_start(more, flags);
    int fd = opened(real, path, flags, more);
    va_end(more);
    return fd;
}
int access(const char *path, int mode) {
    REAL(int, "access", const char *, int);
    if (ours(path) && (mode & W_OK)) FAIL(READONLY);
    return real(path, mode);
}
int faccessat(int folder_fd, const char *path, int mode, int flags) {
    REAL(int, "faccessat", int, const char *, int, int);
    if (ours(path) && (mode & W_OK)) FAIL(READONLY);
    return real(folder_fd, path, mode, flags);
}
