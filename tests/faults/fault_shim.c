/* Preloaded into the program under test: notes its calls of the operating system, and lets one of them fail.

   PULSON_FAULT_LOG=FILE    each call is a line of FILE: its name and the path it is of, where it has one
   PULSON_FAULT=N:WHAT      the N-th of these calls, from 1, fails with the error of number WHAT; where WHAT is SIGINT or
                            SIGTERM the signal goes to the process group, and the call is made

   Only what a program calls through its tables of symbols is met: neither the C library's own calls nor the loader's. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

static atomic_long calls;

static void note(const char* name, const char* path) {
  const char* const log = getenv("PULSON_FAULT_LOG");
  if (log == NULL) return;
  char line[4200];
  const int length = snprintf(line, sizeof line, "%s %s\n", name, path == NULL ? "" : path);
  const long file = syscall(SYS_openat, AT_FDCWD, log, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  if (file < 0) return;
  syscall(SYS_write, file, line, (size_t)(length < (int)sizeof line ? length : (int)sizeof line - 1));
  syscall(SYS_close, file);
}

/* Whether this call is to fail; errno is set then. */
static int fails(const char* name, const char* path) {
  const int before = errno;
  const long number = atomic_fetch_add(&calls, 1) + 1;
  note(name, path);
  errno = before;
  const char* const fault = getenv("PULSON_FAULT");
  if (fault == NULL || strtol(fault, NULL, 10) != number) return 0;
  const char* const what = strchr(fault, ':') + 1;
  if (strcmp(what, "SIGINT") == 0 || strcmp(what, "SIGTERM") == 0) {
    kill(0, what[3] == 'I' ? SIGINT : SIGTERM);
    errno = before;
    return 0;
  }
  errno = (int)strtol(what, NULL, 10);
  return 1;
}

static mode_t mode_of(int flags, va_list arguments) { return (flags & O_CREAT) != 0 ? va_arg(arguments, mode_t) : 0; }

#define OPEN(name)                                       \
  int name(const char* path, int flags, ...) {           \
    va_list arguments;                                   \
    va_start(arguments, flags);                          \
    const mode_t mode = mode_of(flags, arguments);       \
    va_end(arguments);                                   \
    if (fails("open", path)) return -1;                  \
    return (int)syscall(SYS_openat, AT_FDCWD, path, flags, mode); \
  }
OPEN(open)
OPEN(open64)

#define OPENAT(name)                                     \
  int name(int folder, const char* path, int flags, ...) { \
    va_list arguments;                                   \
    va_start(arguments, flags);                          \
    const mode_t mode = mode_of(flags, arguments);       \
    va_end(arguments);                                   \
    if (fails("open", path)) return -1;                  \
    return (int)syscall(SYS_openat, folder, path, flags, mode); \
  }
OPENAT(openat)
OPENAT(openat64)

#define FOPEN(name)                                      \
  FILE* name(const char* path, const char* mode) {       \
    if (fails("open", path)) return NULL;                \
    return REAL(name)(path, mode);                       \
  }
FOPEN(fopen)
FOPEN(fopen64)

ssize_t write(int file, const void* bytes, size_t size) {
  if (fails("write", NULL)) return -1;
  return syscall(SYS_write, file, bytes, size);
}

ssize_t writev(int file, const struct iovec* parts, int count) {
  if (fails("write", NULL)) return -1;
  return syscall(SYS_writev, file, parts, count);
}

int rename(const char* from, const char* to) {
  if (fails("rename", to)) return -1;
  return REAL(rename)(from, to);
}

int link(const char* from, const char* to) {
  if (fails("link", to)) return -1;
  return REAL(link)(from, to);
}

int mkdir(const char* path, mode_t mode) {
  if (fails("mkdir", path)) return -1;
  return REAL(mkdir)(path, mode);
}

#define MMAP(name)                                                                       \
  void* name(void* place, size_t size, int protection, int flags, int file, off_t from) { \
    if (fails("mmap", NULL)) return MAP_FAILED;                                          \
    return (void*)syscall(SYS_mmap, place, size, protection, flags, file, from);         \
  }
MMAP(mmap)
MMAP(mmap64)

#define SPAWN(name)                                                                                                  \
  int name(pid_t* child, const char* path, const posix_spawn_file_actions_t* actions, const posix_spawnattr_t* attributes, \
           char* const arguments[], char* const environment[]) {                                                     \
    if (fails("spawn", path)) return errno;                                                                          \
    return REAL(name)(child, path, actions, attributes, arguments, environment);                                     \
  }
SPAWN(posix_spawn)
SPAWN(posix_spawnp)
