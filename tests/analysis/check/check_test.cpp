#include "analysis/check/check.h"

#include <gtest/gtest.h>
