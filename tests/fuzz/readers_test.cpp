// Broken files of every kind end in a usable mesh or in one line of complaint.
#include <gtest/gtest.h>

#include "fuzz/finding.h"
#include "fuzz/readers.h"
#include "math/random.h"
#include "mesh/files.h"

namespace penalty::testing {
namespace {

class BrokenFiles : public ::testing::TestWithParam<FileFormat> {
 protected:
  // True if the bytes are a mesh.
  bool read(const std::string& bytes) const {
    try {
      return reader_.read(bytes);
    } catch (const Finding& finding) {
      ADD_FAILURE() << finding.what() << "\nin a file of " << bytes.size() << " bytes:\n"
                    << ::testing::PrintToString(bytes);
      return false;
    }
  }

 private:
  ReaderCheck reader_{GetParam()};
};

TEST_P(BrokenFiles, StartFromGoodOnes) {
  for (const std::string& sample : sample_files(GetParam())) EXPECT_TRUE(read(sample)) << sample;
}

TEST_P(BrokenFiles, TruncatedAnywhereGiveAMeshOrAComplaint) {
  for (const std::string& sample : sample_files(GetParam())) {
    std::size_t meshes = 0;
    for (std::size_t length = 0; length < sample.size(); ++length) meshes += read(sample.substr(0, length));
    const std::size_t rest = sample.ends_with(vtk_data) ? vtk_data.size() : 65;
    EXPECT_LT(meshes, rest) << "only what follows the last element may be missing from\n" << sample;
  }
}

TEST_P(BrokenFiles, WithFlippedBytesGiveAMeshOrAComplaint) {
  constexpr unsigned seed = 20240607;
  Random random(seed);
  SCOPED_TRACE("seed " + std::to_string(seed));
  for (const std::string& sample : sample_files(GetParam())) {
    int meshes = 0;
    for (int round = 0; round < 500; ++round) {
      std::string bytes = sample;
      for (unsigned flips = 1 + random.index(3); flips > 0; --flips) {
        // Half of the changes write a digit: text that still parses goes deeper.
        char& byte = bytes[random.index(static_cast<unsigned>(bytes.size()))];
        byte = static_cast<char>(random.index(2) == 0 ? random.index(256) : '0' + random.index(10));
      }
      meshes += read(bytes);
    }
    EXPECT_GT(meshes, 2) << "every change was refused, so nothing deep was tried of\n" << sample;
    EXPECT_LT(meshes, 490) << "hardly a change was noticed in\n" << sample;
  }
}

TEST_P(BrokenFiles, WithPiecesMovedAndNumbersReplacedGiveAMeshOrAComplaint) {
  constexpr unsigned seed = 20261126;
  Random random(seed);
  SCOPED_TRACE("seed " + std::to_string(seed));
  const std::vector<std::string> samples = sample_files(GetParam());
  const std::string numbers[] = {
      "-1",    "0",       "2147483647", "2147483648", "-9223372036854775808", "99999999999999999999", "nan", "inf",
      "1e308", "-1e-320", "0x10",       "1e99999"};
  const auto place = [&random](const std::string& text) {
    return text.empty() ? 0 : random.index(static_cast<unsigned>(text.size()));
  };
  int meshes = 0;
  for (int round = 0; round < 1000; ++round) {
    std::string bytes = samples[random.index(static_cast<unsigned>(samples.size()))];
    for (unsigned changes = 1 + random.index(2); changes > 0; --changes) {
      const std::string& other = samples[random.index(static_cast<unsigned>(samples.size()))];
      const std::size_t to = place(bytes), from = place(other), length = random.index(40);
      switch (random.index(4)) {
        case 0:  // a piece of the same file or of another one comes in
          bytes.insert(to, other.substr(from, length));
          break;
        case 1:  // or replaces what was there
          bytes.replace(to, std::min<std::size_t>(length, bytes.size() - to), other.substr(from, length));
          break;
        case 2:
          bytes.erase(to, length);
          break;
        default: {  // a word becomes a number
          const std::size_t begin = std::min(bytes.find_first_of("0123456789", to), bytes.size());
          const std::size_t end = std::min(bytes.find_first_of(" \n", begin), bytes.size());
          bytes.replace(begin, end - begin, numbers[random.index(std::size(numbers))]);
        }
      }
    }
    meshes += read(bytes);
  }
  EXPECT_GT(meshes, 10) << "every change was refused, so nothing deep was tried";
  EXPECT_LT(meshes, 990) << "hardly a change was noticed";
}

TEST_P(BrokenFiles, WithTrailingGarbageGiveAMeshOrAComplaint) {
  for (const std::string& sample : sample_files(GetParam()))
    for (const std::string& garbage : {std::string("\0\0\0", 3), std::string(5000, '\xff'), std::string("POINTS 7")})
      read(sample + garbage);
}

INSTANTIATE_TEST_SUITE_P(Readers, BrokenFiles, ::testing::ValuesIn(file_formats),
                         [](const auto& info) { return name_of(info.param); });

}  // namespace
}  // namespace penalty::testing
