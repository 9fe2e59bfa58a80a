#include "report/parameter_section.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "model/catalogue.h"

namespace emtb {
namespace {

using testing::HasSubstr;
using testing::Not;

Parameter of_base(const BaseParameter& about, double value) {
  Parameter p;
  p.symbol = about.symbol;
  p.unit = about.unit;
  p.value = value;
  p.min = 0.1 * value;
  p.max = 10 * value;
  p.std_error = 0.01 * value;
  return p;
}

/// A diagnosis that found windage of 1e-6, between bounds that lie far apart.
Diagnosis with_windage() {
  Diagnosis d;
  for (const BaseParameter& about : base_parameters) d.base.base.push_back(of_base(about, 0.5));
  d.final = d.base;
  d.final.include(d.final.effect_named("windage"));
  Parameter& c_w = d.final.effects[0].parameters[0];
  c_w.value = 1e-6;
  c_w.std_error = 1e-8;
  c_w.min = 0;
  c_w.max = 100;
  return d;
}

std::string page_of(const Diagnosis& d) {
  Page page("title", "summary");
  parameter_section(page, d);
  return page.html();
}

TEST(ParameterSection, CallsNoValueAtItsBoundThatTheFitDoesNot) {
  EXPECT_THAT(page_of(with_windage()), Not(HasSubstr("rests on its bound")))
      << "a hundred standard errors away from it, however small beside the upper one";
}

TEST(ParameterSection, SaysWhatTheFitLeftAtABound) {
  Diagnosis d = with_windage();
  d.at_bound = {"windage.c_w"};
  EXPECT_THAT(page_of(d), HasSubstr("rests on its bound"));
}

TEST(ParameterSection, LeavesOutWhatACurrentDriveHasNoEquationFor) {
  Diagnosis d = with_windage();
  EXPECT_THAT(page_of(d), HasSubstr("armature resistance"));
  d.final.input = Signal::i_a;
  EXPECT_THAT(page_of(d), Not(HasSubstr("armature resistance")));
  EXPECT_THAT(page_of(d), HasSubstr("torque constant"));
}

}  // namespace
}  // namespace emtb
