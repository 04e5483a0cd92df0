// Truncated, damaged or inconsistent files: the result is an error that names the position, never a crash,
// and never more memory than the file's size justifies. All formats give the same points.
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>

#include "fusion/cloud/lzf.hpp"
#include "fusion/cloud/read_cloud.hpp"

namespace parhelion::cloud {
namespace {

struct Sample {
  const char* name;
  ScanFormat format;
  std::string bytes;
};

template <class T>
std::string raw(std::initializer_list<T> values, bool swap = false) {
  std::string out;
  for (T value : values) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    if (swap) std::reverse(bytes, bytes + sizeof value);
    out.append(bytes, sizeof value);
  }
  return out;
}

/// A stream of literals only, valid for any LZF reader.
std::string lzf_literals(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); i += 32) {
    const std::string run = text.substr(i, 32);
    out += static_cast<char>(run.size() - 1);
    out += run;
  }
  return out;
}

const std::string kPlyVertex =
    "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
const std::string kPcdHead =
    "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 3\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 "
    "0 "
    "0\nPOINTS 3\n";

/// The points (1 2 3) (-4 5.5 6) (0 0 -1), m, in every format.
std::vector<Sample> samples() {
  const std::string text = "1 2 3\n-4 5.5 6\n0 0 -1\n";
  const auto body = [](bool swap) { return raw<float>({1, 2, 3, -4, 5.5F, 6, 0, 0, -1}, swap); };
  const std::string columns = raw<float>({1, -4, 0, 2, 5.5F, 0, 3, 6, -1});
  const std::string packed = lzf_literals(columns);
  const auto size = [](const std::string& s) { return static_cast<std::uint32_t>(s.size()); };
  return {
      {"ply ascii", ScanFormat::ply, "ply\nformat ascii 1.0\n" + kPlyVertex + text},
      {"ply little", ScanFormat::ply, "ply\nformat binary_little_endian 1.0\n" + kPlyVertex + body(false)},
      {"ply big", ScanFormat::ply, "ply\nformat binary_big_endian 1.0\n" + kPlyVertex + body(true)},
      {"ply with lists and other order", ScanFormat::ply,
       "ply\r\nformat binary_little_endian 1.0\r\nelement sensor 2\r\nproperty uchar id\r\nelement vertex "
       "3\r\nproperty double z\r\nproperty list uchar short seen\r\nproperty short y2\r\nproperty float y\r\n"
       "property int x\r\nend_header\r\n" +
           std::string("ab") + raw<double>({3}) + std::string(1, '\1') + raw<std::int16_t>({7, 9}) +
           raw<float>({2}) + raw<std::int32_t>({1}) + raw<double>({6}) + std::string(1, '\0') +
           raw<std::int16_t>({9}) + raw<float>({5.5F}) + raw<std::int32_t>({-4}) + raw<double>({-1}) +
           std::string(1, '\2') + raw<std::int16_t>({7, 7, 9}) + raw<float>({0}) + raw<std::int32_t>({0})},
      {"pcd ascii", ScanFormat::pcd, kPcdHead + "DATA ascii\n" + text},
      {"pcd binary", ScanFormat::pcd, kPcdHead + "DATA binary\n" + body(false)},
      {"pcd compressed", ScanFormat::pcd,
       kPcdHead + "DATA binary_compressed\n" + raw<std::uint32_t>({size(packed), size(columns)}) + packed},
      {"xyz", ScanFormat::xyz, "x, y, z\n1, 2, 3\n\n# a remark\n-4,5.5,6\n0;0;-1\n"},
      {"3d", ScanFormat::uos_3d, "a heading\n-200 300 100 17\n-550 600 -400 3\n0 -100 0 255\n"},
  };
}

TEST(CloudFormats, all_agree_on_the_same_points) {
  for (const Sample& sample : samples()) {
    const auto scan = parse_scan(sample.bytes, sample.name, sample.format);
    ASSERT_TRUE(scan) << scan.error().message;
    ASSERT_EQ(scan->cloud.size(), 3U) << sample.name;
    EXPECT_TRUE(scan->cloud.points[0].isApprox(Eigen::Vector3f(1, 2, 3))) << sample.name;
    EXPECT_TRUE(scan->cloud.points[1].isApprox(Eigen::Vector3f(-4, 5.5, 6))) << sample.name;
    EXPECT_TRUE(scan->cloud.points[2].isApprox(Eigen::Vector3f(0, 0, -1))) << sample.name;
  }
}

TEST(CloudFormats, units_and_axes_are_as_documented) {
  ReadOptions options;
  options.unit = LengthUnit::millimetre;
  options.axes = FileAxes::x_right_y_down;
  const auto scan = parse_scan("1000 2000 3000\n", "optical.xyz", ScanFormat::xyz, options);
  ASSERT_TRUE(scan);
  EXPECT_TRUE(scan->cloud.points[0].isApprox(Eigen::Vector3f(3, -1, -2)));
  options.axes = FileAxes::x_right_y_up;
  EXPECT_TRUE(parse_scan("1000 2000 3000\n", "gl.xyz", ScanFormat::xyz, options)
                  ->cloud.points[0]
                  .isApprox(Eigen::Vector3f(-3, -1, 2)));
}

TEST(CloudFormats, colours_normals_labels_and_viewpoints_come_along) {
  const auto ply = parse_scan(
      "ply\nformat ascii 1.0\ncomment viewpoint 0 0.5 0 1\nelement vertex 1\nproperty uchar label\n"
      "property float x\nproperty float y\nproperty float z\nproperty uchar blue\nproperty uchar green\n"
      "property uchar red\nproperty float nx\nproperty float ny\nproperty float nz\nproperty int scan\n"
      "end_header\n7 1 2 3 30 20 10 0 0 -2 0\n",
      "a.ply", ScanFormat::ply);
  ASSERT_TRUE(ply) << ply.error().message;
  EXPECT_EQ(ply->cloud.labels, std::vector<std::uint8_t>{7});
  EXPECT_EQ(ply->cloud.colours[0], (std::array<std::uint8_t, 3>{10, 20, 30}));
  EXPECT_EQ(ply->cloud.normals[0], Eigen::Vector3f(0, 0, -1));
  EXPECT_EQ(ply->cloud.viewpoints[0], Eigen::Vector3d(0.5, 0, 1));
  const auto xyz = parse_scan("1 2 3 10 20 30\n1 2 3 255 255 255\n", "a.xyz", ScanFormat::xyz);
  EXPECT_EQ(xyz->cloud.colours[0], (std::array<std::uint8_t, 3>{10, 20, 30}));
  const auto pts = parse_scan("2\n1 2 3 -512 10 20 30\n1 2 3 4 255 255 255\n", "a.pts", ScanFormat::xyz);
  EXPECT_EQ(pts->cloud.colours.size(), 2U);
  const auto pcd = parse_scan(
      "VERSION .7\nFIELDS x y z rgb _\nSIZE 4 4 4 4 1\nTYPE F F F F U\nCOUNT 1 1 1 1 3\nWIDTH 1\nHEIGHT 1\n"
      "VIEWPOINT 1 2 3 1 0 0 0\nDATA ascii\n1 2 3 4.2108e+06 0 0 0\n",
      "a.pcd", ScanFormat::pcd);
  ASSERT_TRUE(pcd) << pcd.error().message;
  EXPECT_EQ(pcd->cloud.viewpoints[0], Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(pcd->cloud.colours.size(), 1U);
}

TEST(CloudFormats, poses_of_3dtk_are_converted_from_left_handed_axes) {
  // 90 degrees about the file's y (up) rotate its z (forward) to its x (right).
  const auto pose = parse_uos_pose("100 200 300\n0 90 0\n", "a.pose");
  ASSERT_TRUE(pose);
  EXPECT_TRUE((*pose * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(3, -2, 2)));
  EXPECT_NEAR(pose->rotation().determinant(), 1, 1e-9);
  EXPECT_FALSE(parse_uos_pose("100 200\n0 90 0\n", "a.pose"));
  EXPECT_FALSE(parse_uos_pose("100 200 x\n0 90 0\n", "a.pose"));
}

TEST(HostileCloud, points_that_are_not_finite_are_dropped_and_counted_and_duplicates_kept) {
  const auto scan = parse_scan("1 2 3\nnan 2 3\n1 inf 3\n1 2 3\n", "a.xyz", ScanFormat::xyz);
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_EQ(scan->cloud.size(), 2U);
  EXPECT_EQ(scan->not_finite, 2U);
  const auto none = parse_scan("nan nan nan\n", "a.xyz", ScanFormat::xyz);
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("all 1 are NaN"), std::string::npos);
}

TEST(HostileCloud, points_of_beams_that_returned_nothing_are_dropped_and_counted) {
  const auto parsed = [](int missing, const std::string& rest) {
    std::string text = rest;
    for (int i = 0; i < missing; ++i) text += "0 0 0 0 0 0 9\n";
    return parse_scan("ply\nformat ascii 1.0\nelement vertex " +
                          std::to_string(std::count(text.begin(), text.end(), '\n')) +
                          "\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\n"
                          "property float ny\nproperty float nz\nproperty uchar label\nend_header\n" +
                          text,
                      "a.ply", ScanFormat::ply);
  };
  const auto scan = parsed(20, "1 2 3 0 0 1 4\n4 5 6 1 0 0 5\n");
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_EQ(scan->no_return, 20U);
  ASSERT_EQ(scan->cloud.size(), 2U);
  EXPECT_EQ(scan->cloud.points[1], Eigen::Vector3f(4, 5, 6));
  EXPECT_EQ(scan->cloud.normals.size(), 2U);
  EXPECT_EQ(scan->cloud.labels, (std::vector<std::uint8_t>{4, 5}));
  ASSERT_FALSE(scan->notes.empty());
  EXPECT_NE(scan->notes.back().find("20 points left out: all at the origin"), std::string::npos);
  EXPECT_EQ(parsed(1, "1 2 3 0 0 1 4\n")->cloud.size(), 2U) << "one may be a point of a surface";
  const auto none = parsed(20, "");
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("all 20 are at the origin"), std::string::npos);
}

TEST(HostileCloud, every_truncation_is_an_error_or_fewer_whole_lines) {
  for (const Sample& sample : samples()) {
    const bool counted = sample.format == ScanFormat::ply || sample.format == ScanFormat::pcd;
    // The last number of a text may lose digits and still be a number; a body without its last end of line is
    // complete.
    const std::size_t whole = sample.bytes.size() - (sample.bytes.ends_with('\n') ? 2 : 0);
    for (std::size_t n = 0; n < whole; ++n) {
      const auto scan = parse_scan(std::string_view(sample.bytes).substr(0, n), sample.name, sample.format);
      EXPECT_FALSE(scan && counted) << sample.name << " cut to " << n;
      if (scan) {
        EXPECT_LE(scan->cloud.size(), 3U);
      } else {
        EXPECT_EQ(scan.error().message.find(sample.name), 0U) << scan.error().message;
      }
    }
  }
}

TEST(HostileCloud, damaged_files_give_a_cloud_or_an_error) {
  std::mt19937 random(1);
  for (const Sample& sample : samples()) {
    for (int i = 0; i < 3000; ++i) {
      std::string bytes = sample.bytes;
      for (int k = 0; k <= i % 3; ++k)
        bytes[random() % bytes.size()] ^= static_cast<char>(1U << random() % 8);
      const auto scan = parse_scan(bytes, sample.name, sample.format);
      if (!scan) continue;
      for (const Eigen::Vector3f& p : scan->cloud.points) EXPECT_TRUE(p.allFinite());
      EXPECT_LE(scan->cloud.size(), bytes.size());
    }
  }
}

TEST(HostileCloud, a_header_larger_than_its_file_is_refused_with_the_offset) {
  const auto message = [](const std::string& bytes, ScanFormat format) {
    const auto scan = parse_scan(bytes, "f", format);
    return scan ? std::string() : scan.error().message;
  };
  const std::string huge = "18446744073709551615";
  for (const char* encoding : {"ascii", "binary_little_endian"}) {
    const std::string error_text =
        message("ply\nformat " + std::string(encoding) + " 1.0\nelement vertex " + huge +
                    "\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
                ScanFormat::ply);
    EXPECT_NE(error_text.find("declares " + huge), std::string::npos) << error_text;
    EXPECT_EQ(error_text.find("f: byte "), 0U) << error_text;
  }
  const std::string fields = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n";
  for (const char* encoding : {"ascii", "binary"}) {
    const std::string error_text =
        message(fields + "WIDTH " + huge + "\nHEIGHT 1\nDATA " + encoding + "\n", ScanFormat::pcd);
    EXPECT_NE(error_text.find("declares " + huge), std::string::npos) << error_text;
  }
  EXPECT_NE(
      message(fields + "WIDTH " + huge + "\nHEIGHT 2\nDATA binary\n", ScanFormat::pcd).find("WIDTH times"),
      std::string::npos);
  EXPECT_NE(message(fields + "WIDTH 3\nHEIGHT 2\nPOINTS 7\nDATA binary\n", ScanFormat::pcd).find("POINTS 7"),
            std::string::npos);
  // 4 GB declared as the decompressed size of 10 bytes.
  const std::string bomb = fields + "WIDTH 300000000\nHEIGHT 1\nDATA binary_compressed\n" +
                           raw<std::uint32_t>({10, 3'600'000'000U}) + "0123456789";
  EXPECT_NE(message(bomb, ScanFormat::pcd).find("cannot unpack"), std::string::npos);
}

TEST(HostileCloud, a_scan_that_exceeds_memory_is_refused_before_reading) {
  ReadOptions options;
  options.memory = 30;
  for (const Sample& sample : samples()) {
    const auto scan = parse_scan(sample.bytes, sample.name, sample.format, options);
    ASSERT_FALSE(scan) << sample.name;
    EXPECT_NE(scan.error().message.find("GB of memory"), std::string::npos) << scan.error().message;
  }
}

TEST(HostileCloud, suspects_millimetres_or_centimetres_given_as_metres) {
  std::string millimetres, centimetres;
  for (int i = 0; i <= 100; ++i) {
    millimetres += "0 0 " + std::to_string(30 * i) + "\n";
    centimetres += "0 0 " + std::to_string(3 * i) + "\n";
  }
  ReadOptions in_millimetres;
  in_millimetres.unit = LengthUnit::millimetre;
  const auto note = [](const std::string& text, ReadOptions options = {}) {
    const auto scan = parse_scan(text, "a.xyz", ScanFormat::xyz, options);
    return scan->notes.empty() ? std::string() : scan->notes[0];
  };
  EXPECT_NE(note(millimetres).find("Give --unit mm"), std::string::npos) << note(millimetres);
  EXPECT_NE(note(centimetres).find("Give --unit cm"), std::string::npos) << note(centimetres);
  EXPECT_EQ(note(millimetres, in_millimetres), "");
}

TEST(HostileCloud, non_numeric_tokens_are_reported_with_their_line) {
  const auto scan = parse_scan("1 2 3\n1 two 3\n", "a.xyz", ScanFormat::xyz);
  ASSERT_FALSE(scan);
  EXPECT_EQ(scan.error().message, "a.xyz:2: expected x y z as numbers, not \"two\"");
  const auto uneven = parse_scan("1 2 3\n1 2 3 4\n", "a.xyz", ScanFormat::xyz);
  ASSERT_FALSE(uneven);
  EXPECT_EQ(uneven.error().message, "a.xyz:2: expected 3 numbers as before, not 4");
}

TEST(HostileCloud, formats_without_a_reader_name_the_command_that_converts_them) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path();
  for (const auto& [name, command] :
       {std::pair("a_scan.LAZ", "pdal translate"), {"a_scan.e57", "CloudCompare"}}) {
    const std::filesystem::path path = folder / name;
    std::ofstream(path) << (path.extension() == ".e57" ? "ASTM-E57" : "LASF");
    const auto scan = read_scan(path);
    std::filesystem::remove(path);
    ASSERT_FALSE(scan);
    EXPECT_NE(scan.error().message.find(command), std::string::npos) << scan.error().message;
  }
}

TEST(Lzf, back_references_may_overlap_and_must_stay_inside) {
  const auto repeated = lzf_decompress(std::string("\0a\xE0\x01\0", 5), 11);
  ASSERT_TRUE(repeated) << repeated.error().message;
  EXPECT_EQ(*repeated, std::string(11, 'a'));
  EXPECT_FALSE(lzf_decompress(std::string("\0a\xE0\x01\1", 5), 11));  // before the beginning
  EXPECT_FALSE(lzf_decompress(std::string("\0a\xE0\x01\0", 5), 10));  // beyond the end
  EXPECT_FALSE(lzf_decompress(std::string("\0a\xE0\x01\0", 5), 12));  // too short
  EXPECT_FALSE(lzf_decompress(std::string("\0a\xE0", 3), 11));        // truncated
}

}  // namespace
}  // namespace parhelion::cloud
