#include "model/machine/chopper.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstdlib>
#include <vector>

#include "tests/model/step_bench.h"
#include "tests/model/switched_bridge.h"

namespace emtb {
namespace {

using namespace step_bench;

Balance<double> chopper(const SwitchedBridge& bridge) {
  Balance<double> terms;
  terms.chop_period = bridge.period;
  terms.chop_supply = bridge.supply;
  terms.chop_decay = bridge.against;
  return terms;
}

TEST(Chopper, LeavesTheMeanOfABridgeThatIsSwitched) {
  for (const double period : {0.1, 1.0, 8.0}) {
    for (const double against : {0.0, 0.7, 12.0}) {
      for (const double back_emf : {-3.0, 0.5, 6.0, 11.0}) {
        for (const double on : {0.1, 0.5, 0.9}) {
          const SwitchedBridge bridge{period, 12, against, back_emf};
          EXPECT_NEAR(chopped(12 * on, back_emf, chopper(bridge)), bridge.mean_voltage(on), 4e-3)
              << period << " L/R, against " << against << " V, " << back_emf << " V back, " << on << " of it on";
          EXPECT_EQ(chopped(-12 * on, -back_emf, chopper(bridge)), -chopped(12 * on, back_emf, chopper(bridge)));
        }
      }
    }
  }
}

TEST(Chopper, LetsNoCurrentFlowWithoutAPulseOrBelowTheBackEmf) {
  const Balance<double> terms = chopper({1, 12, 0, 0});
  EXPECT_EQ(chopped(0.0, 5.0, terms), 5);
  EXPECT_EQ(chopped(6.0, 12.5, terms), 12.5);
}

TEST(Chopper, DrivesAFlywheelByItsMeanAndLetsItCoastWhereNothingIsAskedFor) {
  const double omega = 100, r = 1.3, V_s = 12, V_off = 0.7;
  std::vector<double> flywheel = and_(servo, {r, V_s, V_off / V_s});
  flywheel[base::J] = 1e3;
  ModelStructure s = with({"pwm_drive"});
  Excitation x = holds(1e-3, {{0.1, 9}, {0.1, 3}, {0.1, 0}, {0.1, -3}});
  x.initial.omega = omega;
  const Trajectory<double> y = run(s, flywheel, x);
  for (std::size_t k = 1; k < x.t.size(); k += 21) {  // the bridge takes its time
    const double u = x.u_ref[k - 1], way = u < 0 ? -1 : 1;
    const SwitchedBridge bridge{r, V_s, V_off, way * K * omega};
    const double mean = u == 0 ? K * omega : way * bridge.mean_voltage(std::abs(u) / V_s);
    ASSERT_NEAR(y.e_a[k], mean, 3e-3) << x.t[k] << " s";
    ASSERT_NEAR(R * y.i_a[k], mean - K * omega, 3e-3) << x.t[k] << " s";
  }
}

}  // namespace
}  // namespace emtb
