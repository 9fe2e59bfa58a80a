#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "drivers/simulated/plant.h"
#include "session/session.h"
#include "tests/emtbd.h"
#include "tests/process.h"
#include "tests/session/scratch.h"

namespace emtb {

/// The FH2 of Erdal et al. (2011) at the terminals of a card.
class MotorAtTerminals {
 public:
  /// @param seconds since the one before @param reference [V] at the driver's input
  void advance(double seconds, double reference) { plant_.advance(std::max(seconds, 1e-9), reference); }
  // As the shipped bench files wire it, [V]:
  double tacho() const { return plant_.tacho() / 20; }
  double gauge() const { return plant_.gauge() / 0.2; }
  double armature() const { return plant_.e_a() / 26; }  ///< one end of a differential pair about earth

  /// [rad/s] where it settles: K_m i = B omega + T_c and e_a = R_a i + K_b omega
  static double speed_at(double e_a) {
    const simulated::PlantParameters p = fh2();
    const auto& m = p.motor;
    return (e_a - m.R_a * p.friction.T_c / m.K_m) / (m.K_b + m.R_a * m.B / m.K_m);
  }

 private:
  static simulated::PlantParameters fh2() {
    simulated::PlantParameters p;
    p.driver.gain = 110.0 / 6;
    p.driver.rise = 22.5;
    p.driver.fall = 20.4;
    p.driver.min = 0;
    p.driver.max = 110;
    p.motor.R_a = 31.825;
    p.motor.K_b = p.motor.K_m = 0.6739;
    p.motor.B = 1e-4;
    p.motor.J = 3.449e-3;
    p.friction.T_c = 0.0547;
    return p;
  }
  simulated::Plant plant_{fh2()};
};

/// The unmodified daemon in a process of its own, on a shipped bench file without its meter, with a card that a library
/// makes it see.
class CardBench : public Scratch {
 protected:
  /// @param from a text of the bench file, for which `to` is written
  void start(const std::string& bench, const std::string& library, const std::string& from = "",
             const std::string& to = "") {
#if defined(__SANITIZE_ADDRESS__)
    GTEST_SKIP() << "AddressSanitizer's library and the card's both want to be the first that emtbd loads";
#endif
    library_ = library;
    std::string text = read(EMTB_SOURCE_DIR "/config/benches/" + bench);
    text.erase(text.find("  meter:\n"));
    const std::size_t limit = text.find("  i_a: 2 ");  // which only the meter could guard
    text.erase(limit, text.find('\n', limit) + 1 - limit);
    text.replace(text.find(from), from.size(), to);
    config = write("bench.yaml", text);
    emtbd = std::make_unique<Process>(with_card(emtbd_words(config, path(""))), path("emtbd"));
    daemon = client_of(*emtbd, path("s"));
    ASSERT_TRUE(daemon) << emtbd->err();
  }
  /// The daemon ends before the card that it talks to.
  void TearDown() override {
    daemon.reset();
    emtbd.reset();
  }
  std::vector<std::string> with_card(std::vector<std::string> words) const {
    words.insert(words.begin(), {"/usr/bin/env", "LD_PRELOAD=" + library_});
    return words;
  }
  static double value_at(const Series& series, double t) {
    const auto after = std::ranges::upper_bound(series.t, t);
    return after == series.t.begin() ? std::nan("")
                                     : series.value[static_cast<std::size_t>(after - series.t.begin() - 1)];
  }
  /// A whole step to 3 V, and what the recorded session must say of it.
  /// @param speed [rad/s] @param volts [V] within which it must
  void run_a_step(double speed, double volts) {
    const nlohmann::json ended =
        run_to_its_end(*daemon, "name: step\nkind: step\nlevel: 3\nbefore: 0.5\nhold: 4\nafter: 0.5\n");
    ASSERT_EQ(ended["outcome"], "done") << ended << emtbd->err();
    const Session session = read_session(ended["session"].get<std::string>());
    const auto& run = session.runs.at(0);
    EXPECT_NEAR(value_at(run.at(Signal::omega), 4.4), MotorAtTerminals::speed_at(55), speed);
    EXPECT_NEAR(value_at(run.at(Signal::e_a), 4.4), 55, volts);
    EXPECT_NEAR(value_at(run.at(Signal::e_a), 0.4), 0, volts);
    EXPECT_NEAR(value_at(run.at(Signal::e_a), 2), 22.5 * 1.5, 3) << "the driver's slope, on the loop's clock";
    EXPECT_EQ(value_at(run.at(Signal::u_ref), 2), 3);
    EXPECT_NEAR(static_cast<double>(run.at(Signal::omega).t.size()), 5000, 100) << "1 kHz for 5 s";
  }

  std::filesystem::path config;
  std::unique_ptr<Process> emtbd;
  std::unique_ptr<Client> daemon;

 private:
  std::string library_;
};

}  // namespace emtb
