// The page's own files, compiled in.
#pragma once

#include <string_view>

namespace parhelion::review {

/// `name`: file name in server/review/page; empty result: no such file.
std::string_view page_text(std::string_view name);

}  // namespace parhelion::review
