// A disk that stalls or fills up, for a whole test program: write(2) to regular files and fdatasync(2) wait
// while it is stalled. What the libraries write through stdio is not held up.
#pragma once

namespace parhelion::test {

/// Stalls from construction until release() or destruction. One at a time.
class StalledDisk {
 public:
  StalledDisk();
  ~StalledDisk();
  StalledDisk(const StalledDisk&) = delete;
  StalledDisk& operator=(const StalledDisk&) = delete;
  void release();
  /// Waits until a write is held up; false: none was within 20 s.
  bool await_a_write() const;
};

}  // namespace parhelion::test
