// What a machine must have, one function a question; `parhelion doctor` prints the answers.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace parhelion::tools {

struct MachineCheck {
  enum class Verdict : std::uint8_t { ok, warn, fail };
  std::string name;
  Verdict verdict = Verdict::ok;
  std::string finding;  ///< what was found
  std::string remedy;   ///< what to do, empty where ok
};

/// Opens the bus at `url` (empty: the default one).
MachineCheck check_multicast(const std::string& url);
/// Sends messages of 300 kB to itself and counts those that come back.
MachineCheck check_big_messages(const std::string& url);
/// `rmem_max`: the kernel's file with the largest receive buffer that a program may ask for.
MachineCheck check_receive_buffer(const std::filesystem::path& rmem_max);
/// EGL without a display: a context is made and its renderer named.
MachineCheck check_egl();
/// Room for session logs in `folder`.
MachineCheck check_disk(const std::filesystem::path& folder);
MachineCheck check_processors();
/// Whether this user's programs may go before others: `serve --real-time`.
MachineCheck check_real_time();
/// The recording that `parhelion demo` plays.
MachineCheck check_recording(const std::filesystem::path& rawlog);
/// Files that ship with the program.
MachineCheck check_shipped_files();

}  // namespace parhelion::tools
