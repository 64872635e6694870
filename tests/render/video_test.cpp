#include "render/video.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <stdexcept>

namespace penalty::render {
namespace {

namespace fs = std::filesystem;

bool available(const char* program) {
  return std::system((std::string(program) + " -version > /dev/null 2>&1").c_str()) == 0;
}

std::string output_of(const std::string& command) {
  std::FILE* pipe = popen(command.c_str(), "r");
  std::string text;
  std::array<char, 256> buffer{};
  while (std::fgets(buffer.data(), buffer.size(), pipe)) text += buffer.data();
  pclose(pipe);
  return text;
}

class Video : public testing::Test {
 protected:
  Video() { fs::create_directories(directory); }
  ~Video() override { fs::remove_all(directory); }

  static Image frame(int i, int width = 64, int height = 48) {
    Image image(width, height);
    std::fill(image.rgb.begin(), image.rgb.end(), static_cast<std::uint8_t>(20 * i));
    return image;
  }

  fs::path directory = fs::temp_directory_path() / (std::string("penalty video's ") +
                                                    testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(Video, HoldsEveryFrame) {
  if (!available("ffmpeg")) GTEST_SKIP() << "no ffmpeg";
  const fs::path path = directory / "clip.mp4";
  VideoWriter video(path, 64, 48, {.frames_per_second = 25});
  ASSERT_TRUE(video.encoded());
  for (int i = 0; i < 10; ++i) video.add(frame(i));
  video.finish();
  EXPECT_EQ(video.frames(), 10);
  ASSERT_GT(fs::file_size(path), 500u);
  // +faststart: the index precedes the data.
  std::ifstream file(path, std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(file), {});
  EXPECT_LT(bytes.find("moov"), bytes.find("mdat"));
  if (!available("ffprobe")) GTEST_SKIP() << "no ffprobe: frames not counted";
  EXPECT_EQ(output_of("ffprobe -v error -count_frames -select_streams v -show_entries "
                      "stream=width,height,pix_fmt,r_frame_rate,nb_read_frames -of csv=p=0 \"" +
                      path.string() + "\""),
            "64,48,yuv420p,25/1,10\n");
}

TEST_F(Video, OddSizesAreRoundedUp) {
  if (!available("ffmpeg")) GTEST_SKIP() << "no ffmpeg";
  VideoWriter video(directory / "odd.mp4", 33, 17);
  video.add(frame(1, 33, 17));
  video.finish();
  EXPECT_GT(fs::file_size(directory / "odd.mp4"), 300u);
}

TEST_F(Video, AnimatedWebp) {
  if (!available("ffmpeg")) GTEST_SKIP() << "no ffmpeg";
  VideoWriter video(directory / "clip.webp", 64, 48);
  for (int i = 0; i < 5; ++i) video.add(frame(i));
  video.finish();
  std::ifstream file(directory / "clip.webp", std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(file), {});
  EXPECT_EQ(bytes.substr(8, 4), "WEBP");
  EXPECT_NE(bytes.find("ANIM"), std::string::npos);
}

TEST_F(Video, WithoutFfmpegFramesAndTheirCommandRemain) {
  const fs::path path = directory / "clip.mp4";
  VideoWriter video(path, 64, 48, {.ffmpeg = "no-such-ffmpeg"});
  EXPECT_FALSE(video.encoded());
  for (int i = 0; i < 3; ++i) video.add(frame(i));
  video.finish();
  EXPECT_FALSE(fs::exists(path));
  EXPECT_TRUE(fs::exists(video.frames_directory() / "frame_00000.png"));
  EXPECT_TRUE(fs::exists(video.frames_directory() / "frame_00002.png"));
  EXPECT_FALSE(fs::exists(video.frames_directory() / "frame_00003.png"));
  EXPECT_NE(video.command().find("frame_%05d.png"), std::string::npos) << video.command();
  if (!available("ffmpeg")) GTEST_SKIP() << "no ffmpeg: the command was not tried";
  // The command works as it is printed, in a shell, with a blank and a quote in the path.
  std::string command = video.command();
  command.replace(command.find("no-such-ffmpeg"), 14, "ffmpeg");
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  EXPECT_TRUE(fs::exists(path));
}

TEST_F(Video, DeadEncoderIsAnErrorNotASignal) {
  // `false` exits at once: writing to it would raise SIGPIPE if nobody cared.
  VideoWriter video(directory / "clip.mp4", 64, 48, {.ffmpeg = "false"});
  ASSERT_TRUE(video.encoded());
  EXPECT_THROW(
      {
        for (int i = 0; i < 1000; ++i) video.add(frame(0));
        video.finish();
      },
      std::runtime_error);
}

TEST_F(Video, FailureQuotesFfmpeg) {
  if (!available("ffmpeg")) GTEST_SKIP() << "no ffmpeg";
  try {
    VideoWriter video(directory / "missing" / "clip.mp4", 64, 48);
    for (int i = 0; i < 50; ++i) video.add(frame(0));
    video.finish();
    FAIL() << "wrote into a directory that does not exist";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("No such file"), std::string::npos) << error.what();
  }
}

TEST_F(Video, WrongInputIsThrown) {
  EXPECT_THROW(VideoWriter(directory / "clip.avi", 64, 48), std::invalid_argument);
  EXPECT_THROW(VideoWriter(directory / "clip.mp4", 0, 48), std::invalid_argument);
  EXPECT_THROW(VideoWriter(directory / "clip.mp4", 64, 48, {.frames_per_second = 0}), std::invalid_argument);
  VideoWriter video(directory / "clip.mp4", 64, 48, {.ffmpeg = "no-such-ffmpeg"});
  EXPECT_THROW(video.add(frame(0, 32, 48)), std::invalid_argument);
  video.finish();
  EXPECT_THROW(video.add(frame(0)), std::logic_error);
}

}  // namespace
}  // namespace penalty::render
