#include "tools/export/export_mcap.hpp"

#include <filesystem>

#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "server/station/foxglove/converter.hpp"
#include "server/station/foxglove/schemas.hpp"
#include "server/tick/configuration.hpp"
#include "tools/text_file.hpp"

namespace parhelion::tools {
namespace {

class Export {
 public:
  Export(const ExportOptions& options, McapWriter& writer)
      : options_(options),
        writer_(writer),
        converter_([this](const station::foxglove::Converted& converted) { keep(converted); }) {}

  Status run(LogReader& log);
  ExportReport& report() { return report_; }

 private:
  struct Topic {
    std::uint16_t id = 0;
    std::uint32_t sequence = 0;
  };

  void keep(const station::foxglove::Converted& converted);
  void keep_raw(const Message& message);
  void take(const Message& message);
  void write(const std::string& name, Topic& topic, std::int64_t arrival, std::int64_t stamp,
             std::string_view data);
  std::uint16_t schema(const std::string& name);

  const ExportOptions& options_;
  McapWriter& writer_;
  station::foxglove::Converter converter_;
  std::map<std::string, std::uint16_t> schemas_;
  std::map<std::string, Topic> topics_;
  Status written_;
  ExportReport report_;
};

std::uint16_t Export::schema(const std::string& name) {
  std::uint16_t& id = schemas_[name];
  if (id == 0) id = writer_.add_schema(name, "jsonschema", station::foxglove::schema_text(name));
  return id;
}

void Export::write(const std::string& name, Topic& topic, std::int64_t arrival, std::int64_t stamp,
                   std::string_view data) {
  if (!written_) return;
  written_ = writer_.write({topic.id, ++topic.sequence, static_cast<std::uint64_t>(arrival),
                            static_cast<std::uint64_t>(stamp), data});
  ++report_.messages[name];
}

void Export::keep(const station::foxglove::Converted& converted) {
  const station::foxglove::Channel& channel = converted.channel;
  Topic& topic = topics_[channel.topic];
  if (topic.id == 0) topic.id = writer_.add_channel(channel.topic, schema(channel.schema), "json", {});
  write(channel.topic, topic, converted.arrival.ns, converted.stamp, converted.json);
}

void Export::keep_raw(const Message& message) {
  const std::string name = "lcm/" + message.channel;
  Topic& topic = topics_[name];
  if (topic.id == 0) topic.id = writer_.add_channel(name, 0, "lcm", {{"type", type_name(message.payload)}});
  const auto stamp = leading_stamp(message.payload);
  write(name, topic, message.arrival.ns, stamp ? stamp->ns : message.arrival.ns,
        {reinterpret_cast<const char*>(message.payload.data()), message.payload.size()});
}

void Export::take(const Message& message) {
  if (options_.raw) keep_raw(message);
  const Status read = converter_.take(message);
  if (read) return;
  if (report_.unreadable++ == 0) report_.first_unreadable = read.error().message;
}

Status Export::run(LogReader& log) {
  while (written_) {
    if (options_.stop && options_.stop()) return Error{"stopped; " + options_.output + " is not written"};
    const auto next = log.next();
    if (!next) continue;  // damage: counted below
    if (!*next) break;
    ++report_.events;
    take(**next);
    if (options_.progress) options_.progress(log.offset(), log.size());
  }
  if (!written_) return written_;
  if (report_.events == 0) return Error{options_.log + ": no event in it; expected an LCM log"};
  if (!converter_.begun() && !options_.raw) {
    return Error{options_.log + ": no MR_SESSION in it" +
                 (report_.unreadable > 0 ? " that can be read (" + report_.first_unreadable + ")" : "") +
                 "; expected a session log, as serve and replay -o write it; --raw exports any LCM log"};
  }
  report_.skipped_bytes = log.skipped_bytes();
  report_.bytes_in = log.size();
  report_.omissions = converter_.omissions();
  const std::string name = std::filesystem::path(options_.log).filename().string();
  if (const Status noted =
          writer_.write_metadata("parhelion", {{"log", name}, {"exporter", tick::version_text()}});
      !noted)
    return noted;
  return writer_.finish();
}

}  // namespace

Result<ExportReport> export_mcap(const ExportOptions& options) {
  if (const Status writable = check_writable(options.output, options.overwrite); !writable)
    return writable.error();
  auto log = LogReader::open(options.log);
  if (!log) return log.error();
  ExportReport report;
  const std::string name = std::filesystem::path(options.output).filename().string();
  const Status written = write_beside(options.output, {name}, [&](const std::filesystem::path& folder) {
    McapOptions mcap;
    mcap.compression = options.compression;
    mcap.library = tick::version_text();
    auto writer = McapWriter::create((folder / name).string(), mcap);
    if (!writer) return Status(writer.error());
    Export work(options, *writer);
    const Status done = work.run(*log);
    report = std::move(work.report());
    report.bytes_out = writer->bytes();
    return done;
  });
  if (!written) return written.error();
  return report;
}

}  // namespace parhelion::tools
