#include "server/station/web/page_files.hpp"

#include <zlib.h>

#include "server/station/web/page_table.hpp"

namespace parhelion::station {
namespace {

/// The last four bytes of a gzip member are the length of its content (RFC 1952), little-endian.
std::string inflated(std::string_view gzip) {
  std::size_t size = 0;
  for (std::size_t i = 0; i < 4; ++i)
    size |= static_cast<std::size_t>(static_cast<unsigned char>(gzip[gzip.size() - 4 + i])) << (8 * i);
  std::string text(size, '\0');
  z_stream stream{};
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(gzip.data()));
  stream.avail_in = static_cast<uInt>(gzip.size());
  stream.next_out = reinterpret_cast<Bytef*>(text.data());
  stream.avail_out = static_cast<uInt>(text.size());
  constexpr int gzip_format = 16;
  if (inflateInit2(&stream, MAX_WBITS + gzip_format) != Z_OK) return {};
  const int result = inflate(&stream, Z_FINISH);
  inflateEnd(&stream);
  return result == Z_STREAM_END ? text : std::string();
}

}  // namespace

const PageFile* page_file(std::string_view path) {
  if (path == "/" || path == "/setup") path = "/index.html";
  for (const PageFile& each : page_table())
    if (each.path == path) return &each;
  return nullptr;
}

HttpResponse page_response(const HttpRequest& request) {
  const PageFile* file = page_file(request.path);
  if (!file) return refusal(404, "the page has no such file");
  HttpResponse response;
  response.type = file->type;
  // Cached, but revalidated each time: a new version has the same file names.
  response.headers = {
      {"ETag", std::string(file->etag)}, {"Cache-Control", "no-cache"}, {"Vary", "Accept-Encoding"}};
  if (request.if_none_match == file->etag) {
    response.status = 304;
  } else if (request.accept_encoding.find("gzip") != std::string::npos) {
    response.headers.emplace_back("Content-Encoding", "gzip");
    response.body = file->gzip;
  } else {
    response.body = inflated(file->gzip);
  }
  return response;
}

}  // namespace parhelion::station
