#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace emtb::paper {

/// A number with so many significant digits, trailing zeros left out.
std::string number(double value, int digits = 4);

/// `+27.5 %`
std::string change(double from, double to, int digits = 3);

/// `31.75 ± 0.08`: as many digits as the error is worth.
std::string with_error(double value, double std_error);

/// Markdown, written from top to bottom.
class Markdown {
 public:
  void heading(int level, std::string_view text);

  /// A paragraph; each {} takes the next of the values. @throws Error where they do not match.
  void say(std::string_view text, const std::vector<std::string>& values = {});
  void bullet(std::string_view text, const std::vector<std::string>& values = {});
  void table(const std::vector<std::vector<std::string>>& rows);  ///< the first is the heading
  void picture(const std::string& name, std::string_view alt);

  const std::string& text() const noexcept { return text_; }

 private:
  std::string text_;
  bool in_list_ = false;
};

}  // namespace emtb::paper
