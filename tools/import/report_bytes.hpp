// The result of an import as bytes, for importers that work in a child process.
#pragma once

#include <string>

#include "tools/import/import.hpp"

namespace parhelion::tools {

std::string to_bytes(const Result<ImportReport>& result);
/// `bytes` are of to_bytes().
Result<ImportReport> import_result(const std::string& bytes);

}  // namespace parhelion::tools
