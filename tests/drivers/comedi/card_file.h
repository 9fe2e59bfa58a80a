#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <new>
#include <stdexcept>
#include <string>

#include "tests/drivers/comedi/card.h"

namespace emtb::comedi {

/// A card in a slot of this machine, for the programs in which kernel.cpp is: `comedi0` in a folder of its own.
class CardFile {
 public:
  CardFile() : folder_(std::filesystem::path(::testing::TempDir()) / ("emtb_comedi_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(folder_);
    const int file = ::open(node().c_str(), O_CREAT | O_TRUNC | O_RDWR | O_CLOEXEC, 0600);
    if (file < 0 || ftruncate(file, sizeof(Card)) != 0) throw std::runtime_error("no file for a card");
    memory_ = mmap(nullptr, sizeof(Card), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    ::close(file);
    if (memory_ == MAP_FAILED) throw std::runtime_error("no memory for a card");
    new (memory_) Card;
  }
  ~CardFile() {
    munmap(memory_, sizeof(Card));
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  CardFile(const CardFile&) = delete;
  CardFile& operator=(const CardFile&) = delete;

  std::string node() const { return folder_ / "comedi0"; }
  const std::filesystem::path& folder() const { return folder_; }
  Card* operator->() const { return static_cast<Card*>(memory_); }
  Card& operator*() const { return *static_cast<Card*>(memory_); }

  /// The highest code that output 0 was ever told.
  std::uint32_t highest() const {
    Card& card = **this;
    std::uint32_t most = 0;
    for (std::uint32_t k = 0; k < std::min<std::uint32_t>(card.written, Card::remembered); ++k) {
      most = std::max<std::uint32_t>(most, card.codes[k]);
    }
    return most;
  }

 private:
  std::filesystem::path folder_;
  void* memory_ = nullptr;
};

}  // namespace emtb::comedi
