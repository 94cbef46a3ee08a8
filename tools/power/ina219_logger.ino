// Logs the power of a Crazyflie with an INA219 and any Arduino, as CSV over the serial port, for tools/power/power.py.
//
// Wiring: battery + to VIN+, VIN- to the drone's battery +, grounds together; SDA and SCL to the Arduino's. The
// INA219's bus voltage is then the drone's own. Library: "Adafruit INA219", from the library manager.
// Record: stty -F /dev/ttyUSB0 115200 raw; cat /dev/ttyUSB0 > baseline.csv
// Type a word and Enter to name the stage that follows, such as baseline, FC-FE, CCS-FF, filter, network.
//
// 16 V, 400 mA: 0.1 mA a step, enough for a drone whose motors stand still. Do not fly through it: motors draw
// amperes. One conversion takes 0.5 ms; five are averaged in the 2.7 ms between two lines.
#include <Adafruit_INA219.h>
#include <Wire.h>

const unsigned long PERIOD_US = 5000;  // 200 lines a second
const int AVERAGED = 5;

Adafruit_INA219 meter;
unsigned long nextUs;
char stage[16] = "";
char typed[16];
byte typedLength = 0;

void setup() {
  Serial.begin(115200);
  while (!Serial) {
  }
  if (!meter.begin()) {
    Serial.println("# INA219 not found: check wiring and address 0x40");
    while (true) {
    }
  }
  meter.setCalibration_16V_400mA();
  Wire.setClock(400000);
  Serial.println("time_ms,bus_V,current_mA,stage");
  nextUs = micros();
}

void readStage() {
  while (Serial.available()) {
    const char c = Serial.read();
    if (c == '\n' || c == '\r') {
      if (typedLength > 0) {
        typed[typedLength] = 0;
        strcpy(stage, typed);
        typedLength = 0;
      }
    } else if (c > ' ' && c < 127 && c != ',' && typedLength < sizeof(typed) - 1) {
      typed[typedLength++] = c;
    }
  }
}

void loop() {
  readStage();
  if ((long)(micros() - nextUs) < 0) {
    return;
  }
  nextUs += PERIOD_US;
  const unsigned long now = millis();
  float current = 0.0f;
  for (int i = 0; i < AVERAGED; i++) {
    current += meter.getCurrent_mA() / AVERAGED;
  }
  Serial.print(now);
  Serial.print(',');
  Serial.print(meter.getBusVoltage_V(), 3);
  Serial.print(',');
  Serial.print(current, 2);
  Serial.print(',');
  Serial.println(stage);
}
