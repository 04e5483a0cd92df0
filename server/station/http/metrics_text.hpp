// Metrics in Prometheus' text format, version 0.0.4.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

namespace parhelion::station {

class MetricsText {
 public:
  using Labels = std::vector<std::pair<std::string, std::string>>;

  /// `name`: letters, digits and '_', its unit last ("parhelion_scan_seconds"). Values of one name are
  /// grouped under one heading; names are in the order of their first call.
  void gauge(const std::string& name, const std::string& help, double value, const Labels& labels = {});
  /// Monotonic; `name` ends in "_total".
  void counter(const std::string& name, const std::string& help, double value, const Labels& labels = {});

  std::string text() const;
  static constexpr const char* kType = "text/plain; version=0.0.4; charset=utf-8";

 private:
  void add(const std::string& name, const char* kind, const std::string& help, double value,
           const Labels& labels);

  std::vector<std::string> order_;
  std::map<std::string, std::string> families_;
};

}  // namespace parhelion::station
