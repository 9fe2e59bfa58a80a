#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/figures/xml.h"
#include "tests/tools/command_caller.h"

namespace emtb {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// A small motor with dry friction behind a voltage source that takes its time, as a text book solves it.
std::string recording(double level, double seconds) {
  std::ostringstream csv;
  csv << "t_s,e_a_V,i_a_A,omega_rad_s\n";
  const double R = 2, K = 0.05, B = 2e-5, J = 1e-4, T_c = 0.01, h = 1e-4;
  double omega = 0, e = 0;
  std::uint32_t noise = 1;
  const auto scatter = [&noise] {
    double sum = -6;
    for (int i = 0; i < 12; ++i) {
      noise = noise * 1664525U + 1013904223U;
      sum += static_cast<double>(noise >> 8) / 16777216.0;
    }
    return sum;
  };
  const int steps = static_cast<int>(seconds / h);
  for (int k = 0; k < steps; ++k) {
    const double t = k * h, wanted = t < 0.3 ? 0 : t < 0.5 * seconds ? level : 0.4 * level;
    e += std::clamp(wanted - e, -30 * h, 30 * h);  // [V/s]
    const double i = (e - K * omega) / R;
    if (k % 50 == 0) csv << t << "," << e << "," << i + 0.005 * scatter() << "," << omega + 0.2 * scatter() << "\n";
    const double drive = K * i - B * omega;
    if (omega > 0 || std::abs(drive) > T_c) omega = std::max(0.0, omega + h * (drive - T_c) / J);
  }
  return csv.str();
}

class ReportCommand : public CommandCaller {
 protected:
  ReportCommand() {
    model = write("small.yaml",
                  "name: small\ninput: e_a\ntie: {K_m: K_b}\nparameters:\n"
                  "  R_a: {value: 1.5, min: 0.1, max: 20, unit: ohm}\n"
                  "  K_b: {value: 0.04, min: 0.001, max: 1, unit: V s/rad}\n"
                  "  B: {value: 1.0e-5, min: 0, max: 0.01, unit: N m s/rad}\n"
                  "  J: {value: 2.0e-4, min: 1.0e-6, max: 0.1, unit: kg m2}\n");
    train = write("train.csv", recording(10, 6));
    held_out = write("held.csv", recording(6, 4));
  }

  /// The page without its style sheet, checked.
  std::string body(const std::string& file) {
    const std::string html = read(path(file));
    EXPECT_THAT(html, Not(HasSubstr("https://")));
    EXPECT_THAT(html, Not(HasSubstr("src=")));
    std::string rest = html.substr(std::min(html.find("<body>"), html.size()));
    rest = rest.substr(0, rest.find("</html>"));
    EXPECT_EQ(xml_error(rest), "");
    for (std::size_t at = 0; (at = rest.find("http://", at)) != std::string::npos; ++at)
      EXPECT_EQ(rest.compare(at, 26, "http://www.w3.org/2000/svg"), 0) << rest.substr(at, 60);
    return rest;
  }

  std::string model, train, held_out;
};

TEST_F(ReportCommand, HoldsVerdictFiguresAndAllThatRepeatsIt) {
  ASSERT_EQ(call({"report", model, train + "@0.1:", "--held-out", held_out, "--out", path("r.html"), "--png",
                  path("png"), "--json", path("r.json")}),
            0)
      << last->err();
  EXPECT_EQ(last->err(), "") << "no progress bar into a pipe";
  const json d = json::parse(read(path("r.json")));
  EXPECT_EQ(d["verdict"], "found") << last->out();
  EXPECT_EQ(d["missing"][0]["id"], "coulomb_friction");
  const std::string page = body("r.html");
  EXPECT_THAT(page, AllOf(HasSubstr("The model lacks Coulomb friction (T<sub>c</sub> = 0.0"), HasSubstr(" ± ")));
  for (const char* heading :
       {"Verdict", "Measured over simulated", "Where it fails", "Parameters", "Candidates", "How the error falls",
        "What the equations lack", "Noise floor and data", "To repeat this"})
    EXPECT_THAT(page, HasSubstr("<h2>" + std::string(heading) + "</h2>"));
  EXPECT_THAT(page, AllOf(HasSubstr("held.csv, held out"), HasSubstr("of the base model"),
                          HasSubstr("of the final model"), HasSubstr("noise floor, ±2σ")));
  EXPECT_THAT(page, HasSubstr("emtb add coulomb_friction " + model)) << "what to do next";
  EXPECT_THAT(page, HasSubstr("emtb report " + model + " " + train + "@0.1: --held-out")) << "how it was called";
  EXPECT_THAT(page, HasSubstr("1180 of 1200")) << "the readings that the span leaves out";
  EXPECT_THAT(page, HasSubstr("Signals that these runs lack"));
  EXPECT_THAT(page, HasSubstr("T_c: {value: ")) << "the final model, to be saved";
  Process sum({"/usr/bin/sha256sum", train}, path("sum"));
  ASSERT_EQ(sum.wait(), 0);
  EXPECT_THAT(page, HasSubstr("<code>" + sum.out().substr(0, 64) + "</code>"));
  std::size_t pictures = 0, svgs = 0, narrow = 0;
  for ([[maybe_unused]] const auto& file : std::filesystem::directory_iterator(path("png"))) ++pictures;
  for (std::size_t at = 0; (at = page.find("<svg xmlns", at)) != std::string::npos; ++at) ++svgs;
  for (std::size_t at = 0; (at = page.find("class=\"plot narrow\"", at)) != std::string::npos; ++at) ++narrow;
  EXPECT_EQ(pictures, svgs - narrow) << "every figure is a picture too";
  EXPECT_GT(narrow, 0U) << "a phone has figures of its own";
  EXPECT_GT(pictures, 15U);
}

TEST_F(ReportCommand, ShowsTheRecordingsWhereTheAnalysisRefuses) {
  const std::string no_input = write("blind.csv", "t_s,i_a_A\n0,0\n0.1,0\n0.2,0.1\n");
  EXPECT_EQ(call({"report", model, no_input, "--out", path("r.html"), "--json", path("r.json")}), 1);
  EXPECT_THAT(last->err(), HasSubstr("blind.csv has no e_a_V"));
  const std::string page = body("r.html");
  EXPECT_THAT(page, AllOf(HasSubstr("blind.csv has no e_a_V"), HasSubstr("blind.csv: as recorded"),
                          HasSubstr("Signals that these runs lack"), HasSubstr("the speed, which most of the model")));
  EXPECT_THAT(json::parse(read(path("r.json")))["refused"].get<std::string>(), HasSubstr("e_a_V"));
}

TEST_F(ReportCommand, SaysInOneLineWhereItCannotWrite) {
  EXPECT_EQ(call({"report", model, train, "--out", path("no/such/folder.html")}), 2);
  EXPECT_THAT(last->err(), AllOf(HasSubstr("no/such/folder.html"), HasSubstr("--out")));
  EXPECT_EQ(std::ranges::count(last->err(), '\n'), 1);
}

TEST_F(ReportCommand, ComparePlotsTheWorstSignalInTheTerminal) {
  ASSERT_EQ(call({"compare", model, train, "--fit", "--held-out", held_out, "--plot"}), 0) << last->err();
  EXPECT_THAT(last->out(), AllOf(HasSubstr("held.csv: "), HasSubstr("── measured"), HasSubstr("residual [")));
  EXPECT_THAT(last->out(), Not(HasSubstr("\033"))) << "no colours into a pipe";
  ASSERT_EQ(call({"compare", model, train}), 0);
  EXPECT_THAT(last->out(), Not(HasSubstr("── measured"))) << "into a pipe only where asked";
}

}  // namespace
}  // namespace emtb
