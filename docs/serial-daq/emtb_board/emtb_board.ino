// emtb_board: an Arduino (Uno, Nano, Mega ...) as data acquisition and PWM output of a small motor bench.
// The protocol: docs/serial-daq-protocol.md. The wiring: docs/wiring/serial-daq.md.
//
// 2, 3   encoder A, B         9  PWM of the H bridge       8  its direction
// A0     current sensor       A1 supply voltage, divided   A2 tachogenerator, divided

const uint8_t VERSION = 1;
const char NAME[] = "emtb_board";
const uint8_t PIN_A = 2, PIN_B = 3, PIN_DIRECTION = 8, PIN_PWM = 9;
const uint8_t PIN_ANALOG[3] = {A0, A1, A2};
const int16_t PWM_TOP = 255;
const uint16_t ANALOG_TOP = 1023;
const uint16_t WATCHDOG_MS = 200;  // a host that is silent for longer has died: the motor must not run on
const uint8_t LONGEST = 64;        // bytes of a message

volatile uint32_t counts;
volatile uint8_t phase;

uint8_t incoming[LONGEST + 3];
uint8_t incoming_length;
bool incoming_too_long;

int16_t duty;
bool dropped;
uint32_t last_duty_us;

uint32_t period_us;  // 0: no samples are wanted
uint32_t next_us;
uint16_t number;

// ---- Encoder: all four edges. What jumps over a phase is noise.

void edge() {
  static const int8_t STEP[16] = {0, -1, 1, 0, 1, 0, 0, -1, -1, 0, 0, 1, 0, 1, -1, 0};
  const uint8_t now = (digitalRead(PIN_A) << 1) | digitalRead(PIN_B);
  counts = counts + STEP[(phase << 2) | now];
  phase = now;
}

// ---- Motor

void drive(int16_t wanted) {
  if (wanted > PWM_TOP) wanted = PWM_TOP;
  if (wanted < -PWM_TOP) wanted = -PWM_TOP;
  duty = wanted;
  digitalWrite(PIN_DIRECTION, wanted < 0 ? HIGH : LOW);
  analogWrite(PIN_PWM, wanted < 0 ? -wanted : wanted);
}

void watch() {
  if (duty != 0 && micros() - last_duty_us > 1000UL * WATCHDOG_MS) {
    drive(0);
    dropped = true;
  }
}

// ---- Frames

uint16_t crc(const uint8_t* bytes, uint8_t length) {
  uint16_t sum = 0xFFFF;
  for (uint8_t k = 0; k < length; ++k) {
    sum ^= (uint16_t)bytes[k] << 8;
    for (uint8_t bit = 0; bit < 8; ++bit) sum = sum & 0x8000 ? (sum << 1) ^ 0x1021 : sum << 1;
  }
  return sum;
}

void put16(uint8_t* where, uint16_t value) {
  where[0] = value & 0xFF;
  where[1] = value >> 8;
}

// The message must leave room for its CRC. False where the line is full: a sample is then left out, nothing waits.
bool send(uint8_t* message, uint8_t length) {
  if (Serial.availableForWrite() < length + 4) return false;
  put16(message + length, crc(message, length));
  length += 2;
  uint8_t frame[LONGEST + 4];
  uint8_t mark = 0, end = 1;
  for (uint8_t k = 0; k < length; ++k) {
    if (message[k] == 0) {
      frame[mark] = end - mark;
      mark = end++;
    } else {
      frame[end++] = message[k];
    }
  }
  frame[mark] = end - mark;
  frame[end++] = 0;
  Serial.write(frame, end);
  return true;
}

// Undoes the stuffing in place and checks the CRC. The length of the message, 0 where it is none.
uint8_t unstuff(uint8_t* frame, uint8_t length) {
  uint8_t end = 0;
  for (uint8_t at = 0; at < length;) {
    const uint8_t block = frame[at];
    if (block == 0 || block > length - at) return 0;
    for (uint8_t k = 1; k < block; ++k) frame[end++] = frame[at + k];
    at += block;
    if (at < length) frame[end++] = 0;
  }
  if (end < 3) return 0;
  const uint16_t sum = frame[end - 2] | (uint16_t)frame[end - 1] << 8;
  return crc(frame, end - 2) == sum ? end - 2 : 0;
}

void say_hello() {
  uint8_t message[LONGEST] = {'H', VERSION};
  put16(message + 2, PWM_TOP);
  put16(message + 4, ANALOG_TOP);
  put16(message + 6, WATCHDOG_MS);
  memcpy(message + 8, NAME, sizeof NAME - 1);
  send(message, 8 + sizeof NAME - 1);
}

void obey(const uint8_t* message, uint8_t length) {
  if (message[0] == 'h' && length == 1) say_hello();
  if (message[0] == 'p' && length == 3) {
    drive((int16_t)(message[1] | (uint16_t)message[2] << 8));
    last_duty_us = micros();
    dropped = false;
  }
  if (message[0] == 's' && length == 5) {
    period_us = message[1] | (uint32_t)message[2] << 8 | (uint32_t)message[3] << 16 | (uint32_t)message[4] << 24;
    next_us = micros();
    number = 0;
  }
}

void receive() {
  while (Serial.available() > 0) {
    const uint8_t byte = Serial.read();
    if (byte != 0) {
      if (incoming_length == sizeof incoming) incoming_too_long = true;
      if (!incoming_too_long) incoming[incoming_length++] = byte;
      continue;
    }
    const uint8_t length = incoming_too_long ? 0 : unstuff(incoming, incoming_length);
    if (length > 0) obey(incoming, length);
    incoming_length = 0;
    incoming_too_long = false;
  }
}

// ---- Samples

void sample() {
  if (period_us == 0 || (int32_t)(micros() - next_us) < 0) return;
  next_us += period_us;
  uint8_t message[22] = {'D'};
  noInterrupts();
  const uint32_t counted = counts;
  const uint32_t at = micros();
  interrupts();
  put16(message + 1, number++);
  message[3] = dropped ? 1 : 0;
  put16(message + 4, duty);
  put16(message + 6, counted & 0xFFFF);
  put16(message + 8, counted >> 16);
  put16(message + 10, at & 0xFFFF);
  put16(message + 12, at >> 16);
  for (uint8_t k = 0; k < 3; ++k) put16(message + 14 + 2 * k, analogRead(PIN_ANALOG[k]));
  send(message, 20);
}

void setup() {
  pinMode(PIN_PWM, OUTPUT);
  pinMode(PIN_DIRECTION, OUTPUT);
  dropped = false;
  drive(0);
  pinMode(PIN_A, INPUT_PULLUP);
  pinMode(PIN_B, INPUT_PULLUP);
  counts = 0;
  phase = (digitalRead(PIN_A) << 1) | digitalRead(PIN_B);
  attachInterrupt(digitalPinToInterrupt(PIN_A), edge, CHANGE);
  attachInterrupt(digitalPinToInterrupt(PIN_B), edge, CHANGE);
  period_us = 0;
  incoming_length = 0;
  incoming_too_long = false;
  Serial.begin(115200);
  say_hello();
}

void loop() {
  receive();
  watch();
  sample();
}
