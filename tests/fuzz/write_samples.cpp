// write_samples DIRECTORY: the small files of the tests, a directory a format, for a fuzzer to start from.
#include <fstream>
#include <iostream>

#include "fuzz/readers.h"

int main(int argc, char** argv) {
  using namespace penalty::testing;
  if (argc != 2) {
    std::cerr << "usage: write_samples DIRECTORY\n";
    return 2;
  }
  for (FileFormat format : file_formats) {
    const std::filesystem::path folder = std::filesystem::path(argv[1]) / name_of(format);
    std::filesystem::create_directories(folder);
    int number = 0;
    for (const std::string& text : sample_files(format))
      if (!(std::ofstream(folder / ("sample-" + std::to_string(++number)), std::ios::binary) << text << std::flush)) {
        std::cerr << "write_samples: " << folder.string() << " cannot be written\n";
        return 1;
      }
  }
}
