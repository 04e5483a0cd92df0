// How good the semantic model is on hard made-up sites; not a benchmark of time. semantic_sites [FIRST [LAST
// [DEVICE [KIND]]]]: seeds, and only one device (0 to 7, -1: all) and kind of site (0 to 21; -1: 0 to 9, -2:
// 10 to 21, those of tests/mean_sites/kinds). With a kind each seed has a line.
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <string>

#include "tests/mean_sites/mean_score.hpp"

using namespace parhelion::test;

namespace {

constexpr int kFurtherKinds = -2;

void print(const char* first, const char* second, const MeanScore& s) {
  std::printf(
      "%-12s %-13s F1 %.2f (%.2f %.2f) crossing %5.1f m, false doors %2d pillars %2d flights %d steps %2d; "
      "doors %2d/%2d, "
      "steps %3d/%3d rise %4.1f mm; ramps %2d/%2d false %2d; kerbs %d/%d false %d; floor on things %4.1f %%, "
      "unknown %4.1f %%, "
      "objects %3d/%3d class %3d "
      "false %2d, %.2f s/M (processor %.2f)%s\n",
      first, second, s.f1(), s.precision(), s.recall(), s.crossing, s.false_doors, s.false_pillars,
      s.false_flights, s.false_steps, s.doors_found, s.doors, s.steps_found, s.steps, 1000 * s.rise_error,
      s.ramps_found, s.ramps, s.false_ramps, s.kerbs_found, s.kerbs, s.false_kerbs,
      s.raised > 0 ? 100 * s.called_floor / s.raised : 0, s.points > 0 ? 100 * s.unknown / s.points : 0,
      s.objects_found, s.objects, s.objects_right, s.false_objects,
      s.points > 0 ? 1e6 * s.seconds / s.points : 0, s.points > 0 ? 1e6 * s.processor / s.points : 0,
      s.refused > 0 ? " REFUSED" : "");
  std::fflush(stdout);
}

void print_ramps(const MeanScore& s) {
  if (s.ramps_found == 0) return;
  std::printf("ramps found: slope wrong by %.2f degrees, length and width by %.2f m, on average\n",
              s.slope_error / s.ramps_found * 180 / std::numbers::pi, s.edge_error / s.ramps_found);
}

void print_kerbs(const MeanScore& s) {
  if (s.kerbs_found > 0)
    std::printf("kerbs found: edge wrong by %.3f m on average\n", s.kerb_error / s.kerbs_found);
}

void print_kinds(const MeanScore& s) {
  std::printf("\nobjects found, by true kind:\n");
  std::string row;
  for (const auto& [pair, count] : s.kinds) {
    if (pair.first != row) std::printf("%s%-15s", row.empty() ? "" : "\n", (row = pair.first).c_str());
    std::printf(" %s: %d", pair.second.c_str(), count);
  }
  std::printf("\nfalse objects, by what they are parts of:");
  for (const auto& [label, count] : s.amid) std::printf(" %s %d", label.c_str(), count);
  std::printf("\n");
}

}  // namespace

int main(int argc, char** argv) {
  const auto number = [&](int k, int otherwise) { return argc > k ? std::atoi(argv[k]) : otherwise; };
  const int first = number(1, 1), last = number(2, first), only_device = number(3, -1),
            only_kind = number(4, -1);
  MeanScore all;
  for (int d = 0; d < kDevices; ++d) {
    if (only_device >= 0 && d != only_device) continue;
    MeanScore of_device;
    for (int k = 0; k < kAllSiteKinds; ++k) {
      if (only_kind < 0 && (only_kind == kFurtherKinds) != (k >= kSiteKinds)) continue;
      if (only_kind >= 0 && k != only_kind) continue;
      MeanScore sum;
      for (int seed = first; seed <= last; ++seed) {
        const MeanScore score = score_mean_site(static_cast<SiteKind>(k), static_cast<Device>(d),
                                                static_cast<std::uint64_t>(seed));
        if (only_kind >= 0)
          print(("seed " + std::to_string(seed)).c_str(), to_string(static_cast<Device>(d)), score);
        sum += score;
      }
      print(to_string(static_cast<SiteKind>(k)), to_string(static_cast<Device>(d)), sum);
      of_device += sum;
    }
    print("all", to_string(static_cast<Device>(d)), of_device);
    all += of_device;
  }
  print("all", "all", all);
  print_ramps(all);
  print_kerbs(all);
  print_kinds(all);
}
