// Static content for many browsers: compressed once, and not sent again to a browser that has it.
#pragma once

#include <memory>
#include <string>

#include "server/station/http/http_message.hpp"

namespace parhelion::station {

struct CachedContent {
  std::string type, etag;
  std::shared_ptr<const std::string> bytes;
  std::shared_ptr<const std::string> packed;  ///< gzip; nullptr: compression does not help
};

/// Compresses at gzip `level` 1 (fast) to 9.
CachedContent cached_content(std::string type, std::string bytes, int level = 6);

/// 304 if the browser has it.
HttpResponse answer_with(const HttpRequest& request, const CachedContent& content);

}  // namespace parhelion::station
