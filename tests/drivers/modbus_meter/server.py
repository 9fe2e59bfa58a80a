"""A Modbus meter, by pymodbus: its own framing, checksums and exceptions, nothing of ours.

server.py MOOD tcp PORT | MOOD rtu DEVICE

MOOD is a file that says how to answer: `well`, `silent`, `late SECONDS`, `garbled` (a wrong checksum or transaction), `busy`
(exception 6), `overload`, `nan`, `fast` (0.810 A instead of 0.530 A).

Input registers, unit 7: 0 the current in mA (s16), 2-3 the voltage (f32, ABCD), 4-5 the speed in 0.1 rpm (s32, registers
swapped). Holding register 0: the temperature in 0.1 degC (u16). There is nothing else.
"""
import asyncio
import struct
import sys
import time

from pymodbus.datastore import ModbusServerContext, ModbusSlaveContext, ModbusSparseDataBlock
from pymodbus.framer.rtu_framer import ModbusRtuFramer
from pymodbus.framer.socket_framer import ModbusSocketFramer
from pymodbus.pdu import ExceptionResponse
from pymodbus.server import StartAsyncSerialServer, StartAsyncTcpServer

mood_file, kind, where = sys.argv[1:4]


def mood():
    with open(mood_file) as file:
        return file.read().split() or ["well"]


class Registers(ModbusSparseDataBlock):
    def getValues(self, address, count=1):
        now = mood()[0]
        current = {"fast": 810, "overload": 0x7FFF, "late": 777}.get(now, 530)
        voltage = float("nan") if now == "nan" else 110.25
        self.values[0] = current
        self.values[2], self.values[3] = struct.unpack(">HH", struct.pack(">f", voltage))
        high, low = struct.unpack(">HH", struct.pack(">i", -15080))
        self.values[4], self.values[5] = low, high
        return super().getValues(address, count)


def moody(framer):
    class Moody(framer):
        def buildPacket(self, message):
            how = mood()
            if how[0] == "silent":
                return b""
            if how[0] == "late":
                time.sleep(float(how[1]))
            if how[0] == "busy":
                refusal = ExceptionResponse(message.function_code & 0x7F, 6)
                refusal.unit_id, refusal.transaction_id = message.unit_id, message.transaction_id
                refusal.protocol_id = message.protocol_id
                message = refusal
            packet = super().buildPacket(message)
            if how[0] == "garbled":
                packet = packet[:-1] + bytes([packet[-1] ^ 0x55]) if kind == "rtu" else bytes([packet[0] ^ 0x55]) + packet[1:]
            return packet

    return Moody


async def main():
    block = Registers({address: 0 for address in range(0, 6)})
    meter = ModbusSlaveContext(
        ir=block, hr=ModbusSparseDataBlock({0: 235}), zero_mode=True
    )
    context = ModbusServerContext(slaves={7: meter}, single=False)
    if kind == "tcp":
        await StartAsyncTcpServer(
            context=context, address=("127.0.0.1", int(where)), framer=moody(ModbusSocketFramer), allow_reuse_address=True
        )
    else:
        await StartAsyncSerialServer(
            context=context, port=where, framer=moody(ModbusRtuFramer), baudrate=19200, ignore_missing_slaves=True
        )


asyncio.run(main())
