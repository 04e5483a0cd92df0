#include "server/station/http/cached_content.hpp"

#include <zlib.h>

#include "server/station/http/token.hpp"

namespace parhelion::station {
namespace {

/// nullptr: zlib failed, or the result is not smaller.
std::shared_ptr<const std::string> gzip(const std::string& bytes, int level) {
  z_stream stream{};
  constexpr int window_and_gzip_header = 15 + 16;
  if (deflateInit2(&stream, level, Z_DEFLATED, window_and_gzip_header, 8, Z_DEFAULT_STRATEGY) != Z_OK)
    return nullptr;
  std::string packed(deflateBound(&stream, bytes.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  const bool whole = deflate(&stream, Z_FINISH) == Z_STREAM_END;
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  if (!whole || packed.size() >= bytes.size()) return nullptr;
  return std::make_shared<const std::string>(std::move(packed));
}

bool takes_gzip(std::string_view accept_encoding) {
  const std::size_t at = accept_encoding.find("gzip");
  return at != std::string_view::npos && accept_encoding.substr(at).find("gzip;q=0,") != 0 &&
         accept_encoding.substr(at) != "gzip;q=0";
}

}  // namespace

CachedContent cached_content(std::string type, std::string bytes, int level) {
  CachedContent content{std::move(type), '"' + token_digest(bytes).substr(0, 32) + '"', nullptr,
                        gzip(bytes, level)};
  content.bytes = std::make_shared<const std::string>(std::move(bytes));
  return content;
}

HttpResponse answer_with(const HttpRequest& request, const CachedContent& content) {
  HttpResponse response{.status = 200, .type = content.type};
  response.headers = {{"ETag", content.etag}, {"Vary", "Accept-Encoding"}, {"Cache-Control", "no-cache"}};
  if (request.if_none_match.find(content.etag) != std::string::npos) {
    response.status = 304;
    return response;
  }
  response.shared_body = content.bytes;
  if (content.packed && takes_gzip(request.accept_encoding)) {
    response.shared_body = content.packed;
    response.headers.emplace_back("Content-Encoding", "gzip");
  }
  return response;
}

}  // namespace parhelion::station
