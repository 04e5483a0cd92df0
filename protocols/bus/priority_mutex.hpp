// A mutex for threads of different priority: while a thread waits for it, its holder runs with the waiting
// thread's priority. Priority inheritance: Sha, Rajkumar, Lehoczky, IEEE Transactions on Computers 39 (9),
// 1990.
#pragma once

#include <pthread.h>

#include <system_error>

namespace parhelion {

/// For std::lock_guard.
class PriorityMutex {
 public:
  PriorityMutex() {
    pthread_mutexattr_t attributes;
    pthread_mutexattr_init(&attributes);
    int fault = pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
    if (fault == 0) fault = pthread_mutex_init(&mutex_, &attributes);
    pthread_mutexattr_destroy(&attributes);
    if (fault != 0) throw std::system_error(fault, std::generic_category(), "priority mutex");
  }
  ~PriorityMutex() { pthread_mutex_destroy(&mutex_); }
  PriorityMutex(const PriorityMutex&) = delete;
  PriorityMutex& operator=(const PriorityMutex&) = delete;

  void lock() { pthread_mutex_lock(&mutex_); }
  void unlock() { pthread_mutex_unlock(&mutex_); }

 private:
  pthread_mutex_t mutex_;
};

}  // namespace parhelion
