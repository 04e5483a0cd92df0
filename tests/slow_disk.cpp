#include "tests/slow_disk.hpp"

#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <mutex>

namespace {

struct Disk {
  std::mutex mutex;
  std::condition_variable changed;
  bool stalled = false;
  int held_up = 0;
};

Disk& disk() {
  static Disk the_disk;
  return the_disk;
}

void wait_for_disk(int file) {
  struct stat found {};
  if (fstat(file, &found) != 0 || !S_ISREG(found.st_mode)) return;
  std::unique_lock lock(disk().mutex);
  ++disk().held_up;
  disk().changed.notify_all();
  disk().changed.wait(lock, [] { return !disk().stalled; });
  --disk().held_up;
}

}  // namespace

// The program's own definitions come before the C library's.
extern "C" ssize_t write(int file, const void* bytes, size_t size) {
  wait_for_disk(file);
  return syscall(SYS_write, file, bytes, size);
}
extern "C" int fdatasync(int file) {
  wait_for_disk(file);
  return static_cast<int>(syscall(SYS_fdatasync, file));
}

namespace parhelion::test {

StalledDisk::StalledDisk() {
  const std::lock_guard lock(disk().mutex);
  disk().stalled = true;
}

StalledDisk::~StalledDisk() { release(); }

void StalledDisk::release() {
  const std::lock_guard lock(disk().mutex);
  disk().stalled = false;
  disk().changed.notify_all();
}

bool StalledDisk::await_a_write() const {
  std::unique_lock lock(disk().mutex);
  return disk().changed.wait_for(lock, std::chrono::seconds(20), [] { return disk().held_up > 0; });
}

}  // namespace parhelion::test
