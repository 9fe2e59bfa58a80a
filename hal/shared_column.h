#pragma once

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <iterator>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace emtb {

/// A column of numbers that several may hold: a copy shares the numbers, and whoever changes its own gets numbers of
/// its own first. An hour at 1 kHz is 29 MB a column, and the same times stand in every signal, in what drives the
/// simulation and in what is compared with it.
///
/// It reads like a std::vector. Elements are changed through edit() alone, so that reading never makes a copy.
/// Threads may read what they share, and change columns of their own.
template <class T>
class SharedColumn {
 public:
  using value_type = T;
  using const_iterator = const T*;

  SharedColumn() = default;
  SharedColumn(std::vector<T> numbers) : numbers_(std::make_shared<std::vector<T>>(std::move(numbers))) { look(); }
  SharedColumn(std::initializer_list<T> numbers) : SharedColumn(std::vector<T>(numbers)) {}
  template <std::input_iterator Iterator>
  SharedColumn(Iterator first, Iterator last) : SharedColumn(std::vector<T>(first, last)) {}
  SharedColumn(const SharedColumn&) = default;
  SharedColumn& operator=(const SharedColumn&) = default;
  SharedColumn(SharedColumn&& other) noexcept { swap(other); }
  SharedColumn& operator=(SharedColumn&& other) noexcept {
    SharedColumn taken(std::move(other));
    swap(taken);
    return *this;
  }
  ~SharedColumn() = default;

  std::size_t size() const noexcept { return size_; }
  bool empty() const noexcept { return size_ == 0; }
  const T* data() const noexcept { return data_; }
  const T* begin() const noexcept { return data_; }
  const T* end() const noexcept { return data_ + size_; }
  const T& operator[](std::size_t i) const noexcept { return data_[i]; }
  const T& front() const noexcept { return data_[0]; }
  const T& back() const noexcept { return data_[size_ - 1]; }
  operator const std::vector<T>&() const noexcept {
    static const std::vector<T> nothing;
    return numbers_ ? *numbers_ : nothing;
  }
  bool operator==(const SharedColumn& other) const noexcept {
    return size_ == other.size_ && (data_ == other.data_ || std::equal(begin(), end(), other.begin()));
  }

  /// Holds the numbers of another column in place of the same ones of its own. @return whether they are the same
  bool share(const SharedColumn& other) {
    if (!(*this == other)) return false;
    *this = other;
    return true;
  }

  /// The elements, to be changed; valid until the column is copied or its length changes.
  std::span<T> edit() { return own(); }

  void push_back(const T& number) {
    change([&](auto& v) { v.push_back(number); });
  }
  void pop_back() {
    change([](auto& v) { v.pop_back(); });
  }
  void reserve(std::size_t count) {
    change([&](auto& v) { v.reserve(count); });
  }
  void resize(std::size_t count) {
    change([&](auto& v) { v.resize(count); });
  }
  void assign(std::size_t count, const T& number) { *this = SharedColumn(std::vector<T>(count, number)); }
  template <std::input_iterator Iterator>
  void assign(Iterator first, Iterator last) {
    *this = SharedColumn(first, last);
  }
  void clear() { *this = SharedColumn(); }
  void erase(const T* first, const T* last) {
    const auto from = first - data_, to = last - data_;
    change([&](auto& v) { v.erase(v.begin() + from, v.begin() + to); });
  }
  void erase(const T* at) { erase(at, at + 1); }
  void insert(const T* before, const T& number) {
    const auto at = before - data_;
    change([&](auto& v) { v.insert(v.begin() + at, number); });
  }

 private:
  std::vector<T>& own() {
    if (!numbers_) {
      numbers_ = std::make_shared<std::vector<T>>();
    } else if (numbers_.use_count() > 1) {
      numbers_ = std::make_shared<std::vector<T>>(*numbers_);
    }
    look();
    return *numbers_;
  }
  template <class Change>
  void change(const Change& make) {
    make(own());
    look();
  }
  void look() noexcept {
    data_ = numbers_->data();
    size_ = numbers_->size();
  }
  void swap(SharedColumn& other) noexcept {
    numbers_.swap(other.numbers_);
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
  }

  std::shared_ptr<std::vector<T>> numbers_;  // null: none
  const T* data_ = nullptr;                  // of numbers_: a reader in an innermost loop goes straight there
  std::size_t size_ = 0;
};

}  // namespace emtb
