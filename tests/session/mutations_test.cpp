#include "tests/mutations.h"

#include <gtest/gtest.h>

#include "session/csv.h"
#include "tests/session/scratch.h"

namespace emtb {
namespace {

class CsvMutations : public Scratch {};

TEST_F(CsvMutations, AreReadOrRefusedInOneLine) {
  const std::vector<std::string> seeds{
      "t_s,u_ref_V,e_a_V,i_a_A,omega_rad_s\n0,1,18,0.1,2\n0.001,1,18,,2.5\n0.002,1,18,0.12,3\n",
      "run,t_s,omega_rpm,i_a_mA\na,0,1,2\na,0.1,3,4\nb,0,5,\nb,0.1,7,8\n",
      "t_s;omega_rad_s;torque_Nm\n0;1,5;0,1\n0,1;1,6;0,2\n",
      "t_s,omega_rad_s,omega_lsb_rad_s,armature_open\n0,1,0.1,0\n1,2,,1\n"};
  EXPECT_GT(read_mutations(seeds, 1500, [&](const std::string& text) { read_csv(write("m.csv", text)); }), 100);
}

}  // namespace
}  // namespace emtb
