#include "tools/import/report_bytes.hpp"

#include <nlohmann/json.hpp>

namespace parhelion::tools {
namespace {

using Json = nlohmann::json;

Json to_json(const ChannelReport& channel) {
  return {channel.channel,         channel.kept,           channel.backward,
          channel.backward_max.ns, channel.backward_first, channel.gaps,
          channel.gap_max.ns,      channel.gap_max_place,  Json(channel.beams)};
}

ChannelReport channel_report(const Json& json) {
  ChannelReport channel;
  json.at(0).get_to(channel.channel);
  json.at(1).get_to(channel.kept);
  json.at(2).get_to(channel.backward);
  json.at(3).get_to(channel.backward_max.ns);
  json.at(4).get_to(channel.backward_first);
  json.at(5).get_to(channel.gaps);
  json.at(6).get_to(channel.gap_max.ns);
  json.at(7).get_to(channel.gap_max_place);
  json.at(8).get_to(channel.beams);
  return channel;
}

Json to_json(const ImportReport& report) {
  Json channels = Json::array(), refusals = Json::array();
  for (const ChannelReport& channel : report.channels) channels.push_back(to_json(channel));
  for (const Refusal& refusal : report.refusals)
    refusals.push_back(Json::array({refusal.place, refusal.why, refusal.more}));
  return {{"input", report.input},
          {"output", report.output},
          {"read", report.read},
          {"read_unit", report.read_unit},
          {"channels", channels},
          {"left_out", report.left_out},
          {"refused", report.refused},
          {"refusals", refusals},
          {"damaged", report.damaged},
          {"notes", report.notes},
          {"ahead", report.ahead},
          {"ahead_first_by", report.ahead_first_by.ns},
          {"ahead_first", report.ahead_first},
          {"leaps", report.leaps}};
}

ImportReport import_report(const Json& json) {
  ImportReport report;
  json.at("input").get_to(report.input);
  json.at("output").get_to(report.output);
  json.at("read").get_to(report.read);
  json.at("read_unit").get_to(report.read_unit);
  for (const Json& channel : json.at("channels")) report.channels.push_back(channel_report(channel));
  json.at("left_out").get_to(report.left_out);
  json.at("refused").get_to(report.refused);
  for (const Json& refusal : json.at("refusals"))
    report.refusals.push_back({refusal.at(0), refusal.at(1), refusal.at(2)});
  json.at("damaged").get_to(report.damaged);
  json.at("notes").get_to(report.notes);
  json.at("ahead").get_to(report.ahead);
  json.at("ahead_first_by").get_to(report.ahead_first_by.ns);
  json.at("ahead_first").get_to(report.ahead_first);
  json.at("leaps").get_to(report.leaps);
  return report;
}

}  // namespace

std::string to_bytes(const Result<ImportReport>& result) {
  const Json json = result ? to_json(*result) : Json{{"error", result.error().message}};
  std::string bytes;
  Json::to_cbor(json, bytes);
  return bytes;
}

Result<ImportReport> import_result(const std::string& bytes) {
  const Json json = Json::from_cbor(bytes);
  if (json.contains("error")) return Error{json.at("error").get<std::string>()};
  return import_report(json);
}

}  // namespace parhelion::tools
