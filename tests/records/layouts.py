"""Files of temperatures in the layouts of weather services and loggers, with their right reading.

Every value is invented. The same weather is written in each layout: two days of hours, or two weeks
of days, rounded as the service rounds; `LAYOUTS` names the function that writes it.
"""

# ruff: noqa: E501
# fmt: off

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from typing import Any

BEGIN = datetime(2031, 6, 1)
HOURS = [BEGIN + timedelta(hours=k) for k in range(48)]
T = [round(15.3 - 6.8 * math.cos((k - 3) / 12 * math.pi) + 0.3 * (k % 5), 1) for k in range(48)]
DEW = [round(value - 6, 1) for value in T]
DAYS = [BEGIN + timedelta(days=k) for k in range(16)]
LOW = [round(8.5 + 3 * math.sin(k), 1) for k in range(16)]
HIGH = [round(21.5 + 4 * math.sin(k + 0.5), 1) for k in range(16)]
RH = [50 + k % 30 for k in range(48)]


@dataclass(frozen=True)
class File:
    """A file, and how many readings it has, in degrees Celsius.

    `needs`: the option by which it is refused at first, and `given`: options that read it.
    """

    content: bytes
    readings: int = 48
    first: datetime = HOURS[0]
    last: datetime = HOURS[-1]
    low: float = min(T)
    high: float = max(T)
    missing: int = 0
    needs: str = ""
    given: dict[str, Any] = field(default_factory=dict)
    ending: str = ".csv"
    near: float = 0.051


def hourly(head: str, row: Callable[[int, datetime], str], end: str = "", **about: Any) -> File:
    """Return a file with a row for each hour."""
    return written(head, [row(k, hour) for k, hour in enumerate(HOURS)], end, **about)


def daily(head: str, row: Callable[[int, datetime], str], end: str = "", **about: Any) -> File:
    """Return a file with a row for each day."""
    two = {"readings": 32, "first": DAYS[0] + timedelta(hours=5), "low": min(LOW),
           "last": DAYS[-1] + timedelta(hours=15), "high": max(HIGH)}
    return written(head, [row(k, day) for k, day in enumerate(DAYS)], end, **(two | about))


def written(
    head: str, rows: Sequence[str], end: str = "", *, encoding: str = "utf-8", newline: str = "\n",
    **about: Any,
) -> File:
    lines = [*([head] if head else []), *rows, *([end] if end else [])]
    text = newline.join("\n".join(lines).split("\n")) + newline
    return File(text.encode(encoding), **about)


def comma(value: float) -> str:
    return f"{value}".replace(".", ",")


def tenths(value: float) -> int:
    return round(10 * value)


def fahrenheit(value: float) -> float:
    return round(value * 1.8 + 32, 1)


LAYOUTS: dict[str, Callable[[], File]] = {}
CODED: dict[str, Callable[[], File]] = {}


def add(name: str, make: Callable[[], File]) -> None:
    LAYOUTS[name] = make


def hours(
    name: str, head: str, row: Callable[[int, datetime], str], end: str = "", **about: Any
) -> None:
    add(name, lambda: hourly(head, row, end, **about))


def days(
    name: str, head: str, row: Callable[[int, datetime], str], end: str = "", **about: Any
) -> None:
    add(name, lambda: daily(head, row, end, **about))


def months(
    name: str, head: str, row: Callable[[int, datetime], str], low: float, high: float, **about: Any
) -> None:
    begins = [datetime(2029 + k // 12, k % 12 + 1, 1) for k in range(36)]
    add(name, lambda: written(head, [row(k, m) for k, m in enumerate(begins)], readings=36,
                              first=begins[0], last=begins[-1], low=low, high=high, **about))


# --- services of Europe ---------------------------------------------------------------------------

hours("dwd_hourly", "STATIONS_ID;MESS_DATUM;QN_9;TT_TU;RF_TU;eor",
      lambda k, h: f"        433;{h:%Y%m%d%H};    3;  {T[k]:5};  {RH[k]}.0;eor")
hours("smhi", "Stationsnamn;Stationsnummer;Stationsnät;Mäthöjd (meter över marken)\nX;97400;SMHIs stationsnät;2.0\n\n" "Parameternamn;Beskrivning;Enhet\nLufttemperatur;momentanvärde, 1 gång/tim;celsius\n\n" "Datum;Tid (UTC);Lufttemperatur;Kvalitet;;Tidsutsnitt:",
      lambda k, h: f"{h:%Y-%m-%d};{h:%H:%M:%S};{T[k]};G" + (";;Kvalitetskontrollerade historiska data" if k < 2 else ";;"))
hours("knmi_without_preamble", "STN,YYYYMMDD,HH,T,TD,U",
      lambda k, h: f"260,{h:%Y%m%d},{h.hour},{tenths(T[k])},{tenths(DEW[k])},{RH[k]}")
hours("meteo_france_synop", "numer_sta;date;pmer;t;td;u;vv",
      lambda k, h: f"07005;{h:%Y%m%d%H%M%S};101320;{T[k] + 273.15:.2f};{DEW[k] + 273.15:.2f};{RH[k]};mq", needs="unit", given={"unit": "K"})
months("met_office_monthly", "Oxford\nLocation 450900E 207200N, 63 metres amsl\n   yyyy  mm   tmax    tmin      af    rain     sun\n              degC    degC    days      mm   hours",
       lambda k, m: f"   {m.year}  {m.month:2}   {12 + k % 7}.5    {4 + k % 7}.1       4    {40 + k}.1    {60 + k}.2", 12.5, 18.5, needs="temperature_column", given={"temperature_column": "tmax"})

# --- other continents -----------------------------------------------------------------------------

hours("isd_global_hourly", '"STATION","DATE","SOURCE","LATITUDE","REPORT_TYPE","WND","TMP","DEW","SLP"',
      lambda k, h: f'"72505394728","{h:%Y-%m-%dT%H:%M:%S}","7","40.77","FM-15","340,5,N,0021,5","{tenths(T[k]):+05},5","{tenths(DEW[k]):+05},5","10131,5"')
days("ghcn_access", '"STATION","DATE","LATITUDE","LONGITUDE","ELEVATION","NAME","PRCP","PRCP_ATTRIBUTES","TMAX","TMAX_ATTRIBUTES","TMIN","TMIN_ATTRIBUTES"',
      lambda k, d: f'"USW00094728","{d:%Y-%m-%d}","40.77","-73.96","42.7","NY CITY, NY US","    0",",,W,2400","{tenths(HIGH[k]):5}",",,W","{tenths(LOW[k]):5}",",,W"', needs="unit", given={"scale": "0.1"})
hours("meteostat_bulk_without_names", "",
      lambda k, h: f"{h:%Y-%m-%d},{h.hour},{T[k]},{DEW[k]},{RH[k]},0.0,,220,9.4,,1013.1,,", needs="temperature_column", given={"time_column": ["1", "2"], "temperature_column": "3"})
hours("jma", "ダウンロードした時刻：2031/07/01 10:00:00\n\n,東京,東京,東京,東京,東京\n年月日時,気温(℃),気温(℃),気温(℃),露点温度(℃),露点温度(℃)\n,,品質情報,均質番号,,品質情報",
      lambda k, h: f"{h.year}/{h.month}/{h.day} {h.hour}:00:00,{T[k]},8,1,{DEW[k]},8", encoding="cp932", newline="\r\n")
hours("inmet", "REGIAO:;SE\nUF:;SP\nESTACAO:;SAO PAULO\nLATITUDE:;-23,5\nDATA DE FUNDACAO:;25/07/06\n" "Data;Hora UTC;PRECIPITAÇÃO TOTAL, HORÁRIO (mm);TEMPERATURA DO AR - BULBO SECO, HORARIA (°C);TEMPERATURA DO PONTO DE ORVALHO (°C);TEMPERATURA MÁXIMA NA HORA ANT. (AUT) (°C);TEMPERATURA MÍNIMA NA HORA ANT. (AUT) (°C);UMIDADE RELATIVA DO AR, HORARIA (%);",
      lambda k, h: f"{h:%Y/%m/%d};{h:%H%M} UTC;0;{comma(T[k])};{comma(DEW[k])};{comma(round(T[k] + 1, 1))};{comma(round(T[k] - 1, 1))};{RH[k]};", encoding="latin-1")
hours("cimis", "Stn Id,Stn Name,CIMIS Region,Date,Hour (PST),Jul,ETo (in),qc,Air Temp (F),qc,Rel Hum (%),qc,Dew Point (F),qc,Soil Temp (F),qc",
      lambda k, h: f"6,Davis,Sacramento Valley,{(h - timedelta(hours=1)).month}/{(h - timedelta(hours=1)).day}/{(h - timedelta(hours=1)).year},{(h.hour or 24) * 100:04},{151},0.01, ,{fahrenheit(T[k])}, ,{RH[k]}, ,{fahrenheit(DEW[k])}, ,66.1, ")
days("imd", "INDEX,YEAR,MN,DT,MAX,MIN,RF",
      lambda k, d: f"42182,{d.year},{d.month:02},{d.day:02},{HIGH[k]},{LOW[k]},0.0", needs="time_column", given={"time_column": ["YEAR", "MN", "DT"], "minimum_column": "MIN", "maximum_column": "MAX"})

# --- models, and services of the web --------------------------------------------------------------

hours("era5_csv", "valid_time,u10,d2m,t2m,latitude,longitude",
      lambda k, h: f"{h:%Y-%m-%d %H:%M:%S},-3.1,{DEW[k] + 273.15:.2f},{T[k] + 273.15:.2f},52.5,13.25")
hours("open_meteo_unix", "latitude,longitude\n52.52,13.41\n\ntime,temperature_2m (°C)",
      lambda k, h: f"{(h - datetime(1970, 1, 1)).total_seconds():.0f},{T[k]}", needs="date_format", given={"date_format": "%s"})
hours("wunderground_cells", "Time,Temperature,Dew Point,Humidity,Wind",
      lambda k, h: f"{h:%Y/%m/%d %I:%M %p},{fahrenheit(T[k])} °F,{fahrenheit(DEW[k])} °F,{RH[k]} %,3 mph")
hours("nsrdb", "Source,Location ID,City,Latitude,Longitude,Time Zone,Temperature Units,Clearsky Units\nNSRDB,145809,-,40.57,-105.1,-7,c,w/m2\nYear,Month,Day,Hour,Minute,DHI,DNI,Temperature,Dew Point,Relative Humidity",
      lambda k, h: f"{h.year},{h.month},{h.day},{h.hour},30,0,0,{T[k]},{DEW[k]},{RH[k]}.1", first=HOURS[0] + timedelta(minutes=30), last=HOURS[-1] + timedelta(minutes=30))
hours("merra_tab_doy", "Year\tDOY\tHour\tT_air_C\tRH",
      lambda k, h: f"{h.year}\t{h:%j}\t{h.hour}\t{T[k]}\t{RH[k]}")

# --- loggers --------------------------------------------------------------------------------------

hours("ecowitt_raw", "dateutc,tempinf,humidityin,baromrelin,tempf,humidity,temp1f",
      lambda k, h: f"{h:%Y-%m-%d %H:%M:%S},70.1,41,29.92,{fahrenheit(T[k])},{RH[k]},58.1", needs="temperature_column", given={"temperature_column": "tempf"})
hours("ibutton", "1-Wire/iButton Part Number: DS1922L-F5\nRegistration Number: 8F00\nIs Mission Active?  true\nSample Rate:  Every 3600 second(s)\n\nDate/Time,Unit,Value",
      lambda k, h: f"{h:%m/%d/%y %I:%M:%S %p},C,{T[k]}")

# --- programs -------------------------------------------------------------------------------------

hours("series_without_name", ",0", lambda k, h: f"{h:%Y-%m-%d %H:%M:%S},{T[k]}")
hours("r_write_table", '"time" "temp"', lambda k, h: f'"{k + 1}" "{h:%Y-%m-%d %H:%M:%S}" {T[k]}')
hours("excel_spanish_clock", "Fecha;Temp",
      lambda k, h: f"{h:%d/%m/%Y %I:%M:%S} {'a. m.' if h.hour < 12 else 'p. m.'};{comma(T[k])}")
hours("german_months", "Zeit;Temperatur", lambda k, h: f"{h.day}. {'Juni'} {h.year} {h:%H:%M};{comma(T[k])}")
hours("french", "Date;Température (°C);Humidité",
      lambda k, h: f"{h:%d/%m/%Y} {h:%H}h{h:%M};{comma(T[k])};{RH[k]}", encoding="latin-1")

hours("gbk", "时间,温度(℃),湿度(%)", lambda k, h: f"{h:%Y/%m/%d %H:%M},{T[k]},{RH[k]}", encoding="gbk")
hours("russian", "Дата;Температура;Влажность",
      lambda k, h: f"{h:%d.%m.%Y %H:%M};{comma(T[k])};{RH[k]}", encoding="cp1251")
add(
    "newest_first",
    lambda: written(
        "time,temp", [f"{h:%d/%m/%Y %H:%M},{T[k]}" for k, h in reversed([*enumerate(HOURS)])]
    ),
)

hours("fluxnet", "TIMESTAMP_START,TIMESTAMP_END,TA_F,TA_F_QC,SW_IN_F,VPD_F",
      lambda k, h: f"{h:%Y%m%d%H%M},{h + timedelta(hours=1):%Y%m%d%H%M},{T[k]},0,{k},3.1")
hours("argentina", "FECHA   HORA  TEMP   HUM", lambda k, h: f"{h:%d%m%Y} {h.hour:5} {T[k]:5} {RH[k]:4}")
hours("decimal_commas_unquoted", "time,temp,hum",
      lambda k, h: f"{h:%Y-%m-%d %H:%M},{comma(T[k])},{RH[k]}", needs="delimiter")
hours("thousandths", "time,temp_mdegC",
      lambda k, h: f"{h:%Y-%m-%d %H:%M},{round(1000 * T[k])}", needs="unit", given={"unit": "C", "scale": "0.001"})
hours("first_time_missing", "time,temp",
      lambda k, h: f"{h:%Y-%m-%d %H:%M},{T[k]}" if k else "?,10.5", needs="line 2")
hours("clock_without_date", "time,temp", lambda k, h: f"{h:%H:%M},{T[k]}", needs="date_format")
hours("excel_serial_days", "Date,Temp", lambda k, h: f"{48000 + k / 24:.6f},{T[k]}", needs="date_format")

# --- adversaries ----------------------------------------------------------------------------------

hours("tenths_in_name", "time,temp_tenths_of_degC", lambda k, h: f"{h:%Y-%m-%dT%H:%M},{tenths(T[k])}")
hours("rain_in_inches", "time,temp,rain (in)",
      lambda k, h: f"{h:%Y-%m-%dT%H:%M},{fahrenheit(T[k])},0.0", needs="unit", given={"unit": "F"})
hours("influx_annotated", "#group,false,false,true,true,false,false,true,true\n#datatype,string,long,dateTime:RFC3339,dateTime:RFC3339,dateTime:RFC3339,double,string,string\n#default,_result,,,,,,,\n,result,table,_start,_stop,_time,_value,_field,_measurement",
  lambda k,h: f",,0,2031-06-01T00:00:00Z,2031-06-03T00:00:00Z,{h:%Y-%m-%dT%H:%M:%S}Z,{T[k]},temperature,roof", needs="_column", given={"time_column":"_time","temperature_column":"_value"})
hours("aligned_decimal_commas", "date hour temp hum",
      lambda k, h: f"{h:%d.%m.%Y}   {h:%H:%M}   {comma(T[k])}   {RH[k]},0")
hours("empty_at_the_end", "time,temp", lambda k, h: f"{h:%Y-%m-%d %H:%M},{T[k] if k < 46 else ''}",
      readings=46, last=HOURS[45], low=min(T[:46]), high=max(T[:46]))
hours("text_in_the_last_cell", "time,temperature,status",
      lambda k, h: f"{h:%Y-%m-%d %H:%M},{'error' if k == 47 else T[k]},ok", missing=1)
hours("utc_and_local", "time local,time UTC,temp",
      lambda k, h: f"{(h + timedelta(hours=2)):%Y-%m-%d %H:%M},{h:%Y-%m-%d %H:%M},{T[k]}")
hours("toa5", '"TOA5","Station","CR1000","1234","CR1000.Std.32","CPU:prog.CR1","5432","Table1"\n"TIMESTAMP","RECORD","BattV_Avg","PTemp_C_Avg","AirTC_Avg","RH","SlrW_Avg","T_soil_Avg"\n"TS","RN","Volts","Deg C","Deg C","%","W/m^2","Deg C"\n"","","Avg","Avg","Avg","Smp","Avg","Avg"',
      lambda k, h: f'"{h:%Y-%m-%d %H:%M:%S}",{k},12.91,{T[k] + 3:.2f},{T[k]:.2f},{RH[k]},{k}.1,15.2')
hours("lcd_suspect", '"STATION","DATE","LATITUDE","LONGITUDE","REPORT_TYPE","HourlyDewPointTemperature","HourlyDryBulbTemperature","HourlyPrecipitation","HourlyWetBulbTemperature"',
  lambda k,h: f'"72295023174","{h:%Y-%m-%dT%H:%M:%S}","33.938","-118.388","FM-15","{fahrenheit(DEW[k]):.0f}","{fahrenheit(T[k]):.0f}{"s" if k in (5,17) else ""}","0.00","{fahrenheit(T[k]-2):.0f}"',
  needs="unit", given={"unit":"F"}, near=0.4)
hours("zoned_index", "time,temp",
      lambda k, h: f"{h:%Y-%m-%d %H:%M:%S}+02:00,{T[k]}", first=HOURS[0] - timedelta(hours=2), last=HOURS[-1] - timedelta(hours=2))
hours("epw", "LOCATION,Richmond,VA,USA,TMY3,724010,37.52,-77.32,-5.0,50.0\nDESIGN CONDITIONS,0\nTYPICAL/EXTREME PERIODS,0\nGROUND TEMPERATURES,0\nHOLIDAYS/DAYLIGHT SAVINGS,No,0,0,0\nCOMMENTS 1,x\nCOMMENTS 2,y\nDATA PERIODS,1,1,Data,Sunday, 1/ 1,12/31",
      lambda k, h: f"{(h - timedelta(hours=1)).year},{(h - timedelta(hours=1)).month},{(h - timedelta(hours=1)).day},{h.hour or 24},60,A7A7A7A7?0?0,{T[k]},{DEW[k]},{RH[k]},101300,0,0", needs="time_column", given={"time_column": ["1", "2", "3", "4"], "temperature_column": "7"})
add("twelve_days_ambiguous", lambda: written("date,temp", [f"{d:%m/%d/%Y},{t}" for d, t in zip(DAYS[:12], HIGH, strict=False)], readings=12,
    first=DAYS[0], last=DAYS[11], low=min(HIGH[:12]), high=max(HIGH[:12]), needs="date_format", given={"date_format": "%m/%d/%Y"}))
hours("year_first_short", "time,temp", lambda k, h: f"{h:%y-%m-%d %H:%M},{T[k]}")
hours("rfc", "time,temp", lambda k, h: f'"{h:%a, %d %b %Y %H:%M:%S} GMT",{T[k]}')
days("two_stems", "date,TX,TN,TG_max,TG_min",
      lambda k, d: f"{d:%Y-%m-%d},{HIGH[k]},{LOW[k]},30.1,5.1", needs="minimum_column", given={"minimum_column": "TN", "maximum_column": "TX"})
months("monthly", "month,temp", lambda k, m: f"{m:%Y-%m},{5 + k % 12}.5", 5.5, 16.5)

# --- layouts found by an adversary ----------------------------------------------------------------


hours("davis_ampm", "\t\tTemp\tHi\tLow\tOut\tDew\tWind\tWind\tIn\nDate\tTime\tOut\tTemp\tTemp\tHum\tPt.\tSpeed\tDir\tTemp",
  lambda k,h: f"{h.day}/{h.month}/{h:%y}\t{h:%I:%M}{'a' if h.hour<12 else 'p'}\t{T[k]}\t{T[k]+.4:.1f}\t{T[k]-.4:.1f}\t{RH[k]}\t{DEW[k]}\t3.2\tNW\t21.5")
hours("shelly", "timestamp,temperature_tC,temperature_tF,humidity", lambda k,h: f"{1938038400+3600*k},{T[k]},{fahrenheit(T[k])},{RH[k]}")
for place, words in enumerate(("unavailable,unavailable,error", "sensor restart,n/a,fault", "start,temp,roof")):
    add(f"text_row_{place}", lambda place=place, words=words: hourly("time,temperature,status",
        lambda k, h: (f"{words}\n" if k == place else "") + f"{h:%Y-%m-%d %H:%M},{T[k]},ok", needs="line" if place else ""))
    add(f"text_cell_{place}", lambda place=place: hourly("time,temperature,status",
        lambda k, h: f"{h:%Y-%m-%d %H:%M},{'error' if k == place else T[k]},ok", missing=1))


LONG = [BEGIN + timedelta(hours=k) for k in range(480)]
LONG_T = [T[k % 48] for k in range(480)]
add("another_table_below", lambda: written("time,temp", [f"{h:%Y-%m-%dT%H:%M},{LONG_T[k]}" for k, h in enumerate(LONG)],
    "\n".join(["end,of"] * 41), needs="time = "))


def coded(
    code: str,
    places: Sequence[int],
    *,
    scale: int = 1,
    head: str = "time,temperature",
    **about: Any,
) -> File:
    """Return twenty days of hours with a code for missing."""
    rows = [
        f"{h:%Y-%m-%dT%H:%M},{code if k in places else tenths(LONG_T[k]) if scale == 10 else LONG_T[k]}"
        for k, h in enumerate(LONG)
    ]
    return written(head, rows, readings=480, last=LONG[-1], missing=len(places), **about)


RUNS = {"one": [77], "three": [60, 61, 62], "day": [*range(100, 124)], "several": [*range(40, 47), 99, *range(300, 340)],
        "every_other": [*range(101, 200, 2)], "long": [*range(200, 320)]}
CODES = ("99.9", "999.9", "-9999", "85", "-88.8", "32767", "-99", "-999.0", "9999", "-127", "888.8", "NA", "", "M", "---", "nan", "-32768", "1e20", "6999")
for code in CODES:
    for run, places in RUNS.items():
        CODED[f"{code or 'empty'}_{run}"] = lambda code=code, places=places: coded(code, places)
CODED["tenths"] = lambda: coded(
    "-9999", RUNS["several"], scale=10, head="# temperature in 0.1 °C\ntime,temperature"
)


def zipped() -> File:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("produkt.txt", LAYOUTS["dwd_hourly"]().content)
    return File(packed.getvalue(), ending=".zip")


add("zipped", zipped)
add("utf_16_without_mark",
    lambda: File(LAYOUTS["series_without_name"]().content.decode().encode("utf-16-le")))


# --- layouts that nobody has thought of -----------------------------------------------------------

FORMATS = ("%Y-%m-%d %H:%M", "%Y-%m-%dT%H:%M:%S", "%d.%m.%Y %H:%M", "%d/%m/%Y %H:%M", "%m/%d/%Y %I:%M %p",
           "%d.%m.%y %H:%M", "%Y%m%d%H%M", "%d-%b-%Y %H:%M", "%Y/%m/%d %H:%M:%S")
UNITS: dict[str, Callable[[float], float]] = {
    " (°C)": float, " [degC]": float, "_C": float, "": float, " (F)": fahrenheit, " °F": fahrenheit,
    " [K]": lambda value: round(value + 273.15, 2), " (0.1 °C)": tenths,
}
NAMES = (
    "temp",
    "Temperature",
    "T_air",
    "AirT",
    "Lufttemperatur",
    "Temperatura",
    "t2m_mean",
    "Tair",
    "outdoor temp",
)
OTHERS: dict[str, Callable[[int], Any]] = {
    "Dew Point": lambda k: DEW[k], "Humidity (%)": lambda k: RH[k], "Battery (V)": lambda k: 3.91, "wind speed": lambda k: k % 7,
    "Indoor Temperature": lambda k: 21.1, "Temp quality": lambda k: 1, "wet bulb": lambda k: DEW[k] + 1, "feels like": lambda k: T[k] + 2,
    "Pressure": lambda k: 1013.2, "#": lambda k: k + 1, "remark": lambda k: "ok", "station": lambda k: 433, "Soil temp": lambda k: 14.1,
}


def drawn(random: Any) -> File:
    """Return hours of weather in a layout that a random generator makes up."""
    written_as, unit, name = random.choice(FORMATS), random.choice([*UNITS]), random.choice(NAMES)
    delimiter, sign = random.choice(
        [(",", "."), (";", ","), (";", "."), ("\t", "."), ("\t", ","), ("|", ".")]
    )
    columns: list[tuple[str, Callable[[int], str]]] = [
        (name + unit, lambda k: f"{UNITS[unit](T[k])}".replace(".", sign))
    ]
    for other in random.sample([*OTHERS], random.randint(0, 5)):
        columns.append((other, lambda k, other=other: f"{OTHERS[other](k)}".replace(".", sign)))
    random.shuffle(columns)
    columns.insert(
        random.choice([0, 0, len(columns)]),
        ("Date" if random.random() < 0.5 else "time", lambda k: f"{HOURS[k]:{written_as}}"),
    )
    quote = random.choice(['"', "", ""])
    head = random.choice(["", "", "Station: X\n\n", "# made by somebody\n", "sep=;\n"])
    head += delimiter.join(f"{quote}{title}{quote}" for title, _ in columns)
    rows = [delimiter.join(f"{quote}{cell(k)}{quote}" for _, cell in columns) for k in range(48)]
    end = random.choice(["", "", "mean" + delimiter * (len(columns) - 1), "(c) somebody"])
    near = 0.06 if UNITS[unit] is fahrenheit else 0.051
    return written(head, rows, end, newline=random.choice(["\n", "\r\n"]),
                   encoding=random.choice(["utf-8", "utf-8-sig", "latin-1", "utf-16"]), near=near)
