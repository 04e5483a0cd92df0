#include "tools/slam/slam_report.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "protocols/quantile.hpp"

namespace parhelion::tools {

void count(std::span<const SlamOutput> outputs, SlamLogReport& report) {
  report.answered = outputs.size();
  for (const SlamOutput& output : outputs) {
    switch (output.estimate.state) {
      case SlamState::initializing:
        ++report.initializing;
        break;
      case SlamState::tracking:
        ++report.tracking;
        break;
      case SlamState::lost:
        ++report.lost;
        break;
      case SlamState::unsure:
        ++report.unsure;
        break;
    }
  }
}

std::string summary_line(const SlamLogReport& report) {
  char text[512];
  std::snprintf(
      text, sizeof text,
      "%llu scans over %.1f s in %.1f s: %llu tracking, %llu initializing, %llu unsure, %llu lost; step p50 "
      "%.2f p90 %.2f p99 %.2f "
      "max %.2f ms; loops %.1f s; %s trajectory; map %.12s",
      static_cast<unsigned long long>(report.scans), report.log_seconds, report.seconds,
      static_cast<unsigned long long>(report.tracking), static_cast<unsigned long long>(report.initializing),
      static_cast<unsigned long long>(report.unsure), static_cast<unsigned long long>(report.lost),
      report.step.p50 / 1e3, report.step.p90 / 1e3, report.step.p99 / 1e3, report.step.max / 1e3,
      report.loop_seconds, report.causal ? "causal" : "final", report.map_id.c_str());
  return text;
}

StepPercentiles percentiles(std::vector<double> microseconds) {
  if (microseconds.empty()) return {};
  const auto at = [&](double fraction) { return quantile(microseconds, fraction, QuantileRank::upper); };
  return {at(0.5), at(0.9), at(0.99), at(1)};
}

std::string dated(const pose::OdometryFinding& finding, SensorTime first_scan) {
  char span[64];
  const double since = (finding.since - first_scan).seconds();
  if (finding.until)
    std::snprintf(span, sizeof span, "%.1f to %.1f s: ", since, (*finding.until - first_scan).seconds());
  else
    std::snprintf(span, sizeof span, "from %.1f s: ", since);
  return span + finding.text;
}

std::string offset_note(const std::optional<pose::ClockOffset>& offset) {
  constexpr double kMatters = 0.08, kSure = 5;  // s, sigmas
  if (!offset || std::abs(offset->seconds) < std::max(kMatters, kSure * offset->sigma)) return "";
  char text[160];
  std::snprintf(
      text, sizeof text,
      "stamps of odometry are %.2f s %s against those of the scans; parhelion calibrate corrects it",
      std::abs(offset->seconds), offset->seconds > 0 ? "early" : "late");
  return text;
}

nlohmann::ordered_json faults_json(std::span<const pose::OdometryFinding> findings, SensorTime first_scan) {
  auto faults = nlohmann::ordered_json::array();
  for (const pose::OdometryFinding& finding : findings) {
    nlohmann::ordered_json fault = {{"fault", to_string(finding.fault)},
                                    {"since_s", (finding.since - first_scan).seconds()},
                                    {"until_s", nullptr},
                                    {"text", finding.text}};
    if (finding.until) fault["until_s"] = (*finding.until - first_scan).seconds();
    faults.push_back(std::move(fault));
  }
  return faults;
}

std::string to_json(const SlamLogReport& report) {
  nlohmann::ordered_json json;
  json["scans"] = report.scans;
  json["odometry"] = report.odometry;
  json["answered"] = report.answered;
  json["tracking"] = report.tracking;
  json["unsure"] = report.unsure;
  json["lost"] = report.lost;
  json["initializing"] = report.initializing;
  json["refused"] = report.refused;
  json["replaced"] = report.replaced;
  json["causal"] = report.causal;
  json["map_id"] = report.map_id;
  json["step_us"] = {
      {"p50", report.step.p50}, {"p90", report.step.p90}, {"p99", report.step.p99}, {"max", report.step.max}};
  json["loop_seconds"] = report.loop_seconds;
  json["seconds"] = report.seconds;
  json["log_seconds"] = report.log_seconds;
  json["findings"] = report.findings;
  if (report.odometry_offset)
    json["odometry_offset_s"] = {{"value", report.odometry_offset->seconds},
                                 {"sigma", report.odometry_offset->sigma}};
  json["odometry_faults"] = faults_json(report.odometry_findings, report.first_scan);
  return json.dump(2) + "\n";
}

}  // namespace parhelion::tools
