#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/process.h"
