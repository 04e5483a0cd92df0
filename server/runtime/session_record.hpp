// Converts a session log to a row of the trainees' records.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "server/runtime/grade_session.hpp"
#include "server/training/records.hpp"

namespace parhelion::runtime {

/// Graded by grade_session(), which defines `progress` and the Errors. Identity: SHA-256 of MR_SESSION and
/// its stamp, so a copy, a truncated log and a replay are the same session, and another scenario or seed is
/// not.
Result<training::SessionRecord> session_record(
    const std::string& path, const std::function<void(std::uint64_t, std::uint64_t)>& progress = {});

/// SessionRecord::identity of a log, without grading it.
Result<std::string> session_identity(const std::string& path);

}  // namespace parhelion::runtime
